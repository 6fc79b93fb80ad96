// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// First-order low-pass filters, y += a (x - y) once a tick, a = 1 - exp(-2 pi f T) (67).
#pragma once
#include "fixed.h"

namespace flexura {

// Velocity from the counts of a tick. Q16 inside, so that one count a second is still seen.
class Velocity {
 public:
  void start() { filtered_ = 0; }
  void update(int8_t moved, uint16_t filter) {
    filtered_ += multiply_q16(static_cast<int32_t>(moved) * 65536 - filtered_, filter);
  }
  int16_t value() const { return saturate16(filtered_ >> 8); }  // counts / 256 per tick

 private:
  int32_t filtered_ = 0;
};

// A set-point. A filter of 0 lets it pass.
class Setpoint {
 public:
  void start(int32_t position) { position_ = position; }
  int32_t update(int32_t position, uint16_t filter) {
    const int32_t way = subtract(position, position_);
    return position_ += filter ? multiply_q16(way, filter) : way;
  }
  int32_t position() const { return position_; }  // counts / 256

 private:
  int32_t position_ = 0;
};

}  // namespace flexura
