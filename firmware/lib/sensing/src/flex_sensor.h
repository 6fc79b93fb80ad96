// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Tip deflection from the flex sensor: w = c1 x + c2 x^2 + c3 x^3, x = reading - zero, then
// a first-order filter and its rate.
#pragma once
#include "declaration.h"
#include "fixed.h"

namespace flexura {

// Deflections are in units of 10 um; Q8 adds eight bits of fraction. Readings are sums of two
// ticks' conversions.
struct FlexSensorScale {
  int16_t zero = 0;                // reading of the straight strip
  int32_t c1 = 0, c2 = 0, c3 = 0;  // Q8, for x as Q16: (reading - zero) x 4
  uint16_t filter = UINT16_MAX;    // Q16, of what is new in two ticks
};

static_assert(2L * 1024 * kAdcSamples * 4 <= 32768, "any difference of readings fits");

class FlexSensor {
 public:
  void start(const FlexSensorScale &scale, uint16_t reading) {
    filtered_ = raw(scale, reading);
    rate_ = 0;
  }

  void update(const FlexSensorScale &scale, uint16_t reading) {
    const int32_t before = filtered_;
    filtered_ =
        add(filtered_, multiply_q16(subtract(raw(scale, reading), filtered_), scale.filter));
    rate_ = saturate16(subtract(filtered_, before));
  }

  static int32_t raw(const FlexSensorScale &scale, uint16_t reading) {
    const int16_t x = saturate16((static_cast<int32_t>(reading) - scale.zero) * 4);
    return multiply_high(add(multiply_high(add(multiply_high(scale.c3, x), scale.c2), x), scale.c1),
                         x);
  }

  int16_t deflection() const { return saturate16(filtered_ >> 8); }  // 10 um
  int16_t rate() const { return rate_; }                             // 10 um / 256 in two ticks

 private:
  int32_t filtered_ = 0;
  int16_t rate_ = 0;
};

}  // namespace flexura
