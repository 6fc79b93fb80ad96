// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The settings in EEPROM, under the declaration's hash and a CRC. Written byte by byte between
// other work: 3.4 ms each.
#pragma once
#include "fixed_point_config.h"

namespace eeprom {

// False if nothing is there, or it is damaged or of another declaration.
bool load(flexura::Stored &stored);

void begin_save(const flexura::Stored &stored);
enum class Progress : uint8_t { busy, done, failed };
Progress save();  // a step of it

}  // namespace eeprom
