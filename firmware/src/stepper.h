// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Step pulses: edges that timer 5 itself gives at exact times, from a queue that the control
// interrupt fills.
#pragma once
#include "step_generator.h"

namespace stepper {

void begin();  // pins; pulses off, driver off
void enable(bool on);

// Adds a plan to the queue. tick: timer 5 at the start of the plan. Interrupts off.
void queue(const flexura::StepPlan &plan, uint16_t tick);

void stop();             // at once; what was queued is forgotten. Interrupts off.
void begin_interrupt();  // lets the matches of the step's compare unit through
uint8_t given();         // pulses, up minus down; wraps

}  // namespace stepper
