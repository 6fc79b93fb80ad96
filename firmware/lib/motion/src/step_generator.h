// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Step pulses from a rate: which steps fall into the next control tick, and when exactly.
#pragma once
#include "fixed.h"

namespace flexura {

constexpr uint16_t kTickCounts = 2000;  // of the 2 MHz step timer
constexpr uint8_t kStepsPerTick = 5;    // 4000 a second, and one that the phase may add

struct StepPlan {
  uint8_t count = 0;
  bool up = false;
  uint16_t at[kStepsPerTick];  // timer counts from the start of the tick, ascending
};

// The position asked for runs evenly through each tick; a step is given where it has gone 3/4 of a
// microstep beyond the steps given, in either direction. The half microstep between the two keeps
// noise about a turning point from becoming pulses, and gives the driver time to take a new
// direction.
class StepGenerator {
 public:
  void start(int32_t given) {
    given_ = given;
    ahead_ = 0;
  }
  // rate: microsteps / 4096 per tick, within +-4 microsteps.
  void plan(int16_t rate, StepPlan &plan);
  int32_t given() const { return given_; }  // microsteps, planned ones included
  // Microsteps / 256, at the end of the plan.
  int32_t position() const { return to_q8(given_) + (ahead_ >> 4); }

 private:
  int32_t given_ = 0;
  int16_t ahead_ = 0;  // microsteps / 4096: position - given
};

}  // namespace flexura
