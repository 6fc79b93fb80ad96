// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "pid.h"

namespace flexura {

int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate) {
  Accumulator48 sum;
  sum.add(gains.kf, deflection);
  sum.add(gains.kg, rate);
  return sum.value();
}

template class PidOf<BoardNumbers>;

}  // namespace flexura
