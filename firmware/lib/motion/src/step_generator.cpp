// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "step_generator.h"

namespace flexura {

namespace {
constexpr int16_t kStep = 4096;
constexpr int16_t kThreshold = 3 * kStep / 4;

// part / whole as Q12, rounded down, bit by bit: a third of what a division costs. 0 <= part <=
// whole < 2^15.
uint16_t ratio(uint16_t part, uint16_t whole) {
  uint16_t quotient = 0;
  for (uint8_t bit = 0; bit < 12; ++bit) {
    part = static_cast<uint16_t>(part << 1);
    quotient = static_cast<uint16_t>(quotient << 1);
    if (part >= whole) {
      part = static_cast<uint16_t>(part - whole);
      ++quotient;
    }
  }
  return quotient;
}
}  // namespace

void StepGenerator::plan(int16_t rate, StepPlan &plan) {
  plan.up = rate > 0;
  plan.count = 0;
  // Mirrored so that the position always rises.
  const int16_t pace = plan.up ? rate : -rate;
  const int16_t from = plan.up ? ahead_ : -ahead_;
  int16_t over = from + pace - kThreshold;
  ahead_ = static_cast<int16_t>(ahead_ + rate);
  if (over < 0) return;
  uint8_t count = 1;
  while ((over = static_cast<int16_t>(over - kStep)) >= 0 && count < kStepsPerTick) ++count;
  const int16_t way = static_cast<int16_t>(count * kStep);
  plan.count = count;
  if (plan.up) {
    given_ += count;
    ahead_ = static_cast<int16_t>(ahead_ - way);
  } else {
    given_ -= count;
    ahead_ = static_cast<int16_t>(ahead_ + way);
  }
  // More than 0: the tick before gave the step otherwise, and a rate that turned round starts
  // below.
  const uint16_t first = static_cast<uint16_t>(kThreshold - from);
  if (count == 1) {
    plan.at[0] = static_cast<uint16_t>(unsigned_product(ratio(first, pace), kTickCounts) >> 12);
    return;
  }
  const uint16_t interval =
      static_cast<uint16_t>(unsigned_product(ratio(kStep, pace), kTickCounts) >> 8);  // 1/16 counts
  uint16_t at = static_cast<uint16_t>(unsigned_product(first, interval) >> 12);
  for (uint8_t k = 0; k < count; ++k) {
    plan.at[k] = at >> 4;
    at = static_cast<uint16_t>(at + interval);
  }
}

}  // namespace flexura
