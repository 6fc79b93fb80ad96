#include "pid.h"

namespace flexura {

int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate) {
  Sum sum;
  sum.add(gains.kf, deflection);
  sum.add(gains.kg, rate);
  return sum.value();
}

template class PidOf<BoardNumbers>;

}  // namespace flexura
