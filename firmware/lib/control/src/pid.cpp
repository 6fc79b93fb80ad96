#include "pid.h"

namespace flexura {

int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate) {
  return strip_term<Sum>(gains.kf, gains.kg, deflection, rate);
}

template class Law<Integers>;

}  // namespace flexura
