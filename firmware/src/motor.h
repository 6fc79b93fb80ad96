// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The motor's bridge: 20 kHz PWM on one of two lines, and its enable.
#pragma once
#include <stdint.h>

namespace motor {

void begin();
void drive(int16_t duty);  // counts of kDutyFull, + up. Interrupts off.
void enable(bool on);      // interrupts off
bool enabled();

}  // namespace motor
