// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The motors' bridges: 20 kHz PWM on one of two lines each, and their enables.
#pragma once
#include <stdint.h>

namespace motor {

void begin();
void drive(const int16_t duty[2]);     // counts of kDutyFull, + up. Interrupts off.
void enable(bool first, bool second);  // interrupts off
bool enabled();                        // one of them

}  // namespace motor
