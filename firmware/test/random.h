// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Random numbers of the unit tests, alike on the host and on the AVR.
#pragma once
#include <stdint.h>

static uint32_t seed = 1;
inline uint32_t random32() {
  seed ^= seed << 13;
  seed ^= seed >> 17;
  return seed ^= seed << 5;
}
inline int32_t between(int32_t least, int32_t most) {
  return least + static_cast<int32_t>(random32() % static_cast<uint32_t>(most - least + 1));
}
