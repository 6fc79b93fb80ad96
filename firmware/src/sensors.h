// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Encoders by external interrupts, the ADC in step with the control tick, the switches.
#pragma once
#include "fault_monitor.h"

namespace sensors {

void begin();
void sample();  // begins this tick's conversions. Interrupts off.
void resume();  // goes on with them after the control. Interrupts off.
// What came in since the last call; readings are those of the tick before. Interrupts off.
void read(flexura::Inputs &in);
void reopen();  // encoder interrupts that a flood of edges has shut. Interrupts off.

}  // namespace sensors
