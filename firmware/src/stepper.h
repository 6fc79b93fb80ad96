// Step pulses: edges that timer 5 itself gives at exact times (OC5B), from a queue that the control interrupt fills.
#pragma once
#include "steps.h"

namespace stepper {

void begin();                                        // pins; pulses off, driver off
void enable(bool on);
void queue(const flexura::StepPlan &plan, uint16_t tick);   // `tick`: timer 5 at the start of the plan. Interrupts off.
void stop();                                         // at once; what was queued is forgotten. Interrupts off.
uint8_t given();                                     // pulses, up minus down; wraps

}  // namespace stepper
