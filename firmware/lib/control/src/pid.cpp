// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "pid.h"

namespace flexura {

int32_t added_terms(const PidGains &gains, int16_t deflection, int16_t rate, int32_t disturbance) {
  Accumulator48 sum(disturbance);
  sum.add(gains.kf, deflection);
  sum.add(gains.kg, rate);
  return sum.value();
}

template class PidOf<BoardNumbers>;

}  // namespace flexura
