#include "steps.h"

namespace flexura {

namespace {
constexpr int32_t kStep = 65536, kThreshold = 3 * kStep / 4;
}

void Steps::plan(int32_t rate, StepPlan &plan) {
  const int32_t advance = rate / 8192;                       // Q16 microsteps in this tick
  plan.up = advance > 0;
  plan.count = 0;
  // Mirrored so that the position always rises.
  const int32_t pace = plan.up ? advance : -advance, from = plan.up ? ahead_ : -ahead_;
  int32_t first = kThreshold - from, over = from + pace - kThreshold;
  ahead_ += advance;
  if (over < 0) return;
  while (over >= 0 && plan.count < kStepsPerTick) ++plan.count, over -= kStep;
  given_ += plan.up ? plan.count : -plan.count;
  ahead_ -= plan.up ? plan.count * kStep : -(plan.count * kStep);
  if (first < 0) first = 0;                                  // after a reversal without a step between

  if (plan.count == 1) {                                     // one division, exact
    plan.at[0] = static_cast<uint16_t>(static_cast<uint32_t>(first) * kTickCounts / static_cast<uint32_t>(pace));
    return;
  }
  // Several: one division for the interval, in 1/256 timer counts; the pace is more than a whole step.
  const uint32_t interval = (static_cast<uint32_t>(kTickCounts) << 20) / static_cast<uint32_t>(pace >> 4);
  uint32_t at = (static_cast<uint32_t>(first >> 4) * interval) >> 12;
  for (uint8_t k = 0; k < plan.count; ++k, at += interval) plan.at[k] = static_cast<uint16_t>(at >> 8);
}

}  // namespace flexura
