// The motor's bridge: 20 kHz PWM on one of two lines, and its enable.
#pragma once
#include <stdint.h>

namespace motor {

void begin();
void drive(int16_t duty);      // counts of kDutyFull, + up. Interrupts off.
void enable(bool on);          // interrupts off
}  // namespace motor
