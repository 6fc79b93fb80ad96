#include "pid.h"

namespace flexura {

int16_t Pid::held(const PidGains &gains, int32_t wish) const {
  const int16_t limited = clamp<int16_t>(narrow(wish), static_cast<int16_t>(-gains.limit), gains.limit);
  return clamp<int16_t>(limited, static_cast<int16_t>(output_ - gains.slew), static_cast<int16_t>(output_ + gains.slew));
}

int16_t Pid::update(const PidGains &gains, const PidSignals &in) {
  const int16_t counts = narrow(in.error >> 8);
  const uint16_t part_of_count = static_cast<uint16_t>(static_cast<uint8_t>(in.error) << 8);

  const int32_t grown = add(multiply(gains.ki, counts), carry_);
  int32_t integral = integral_ + (grown >> 8);
  if (upper(integral) > gains.limit || upper(integral) < -gains.limit) integral = integral_;

  Sum sum(add(integral, fraction(gains.kp, part_of_count)));
  sum.add(gains.kp, counts);
  sum.add(gains.kd, narrow(static_cast<int32_t>(in.setpoint_rate) - in.rate));
  sum.add(gains.kf, in.deflection);
  sum.add(gains.kg, in.deflection_rate);
  sum.add(gains.kv, in.setpoint_rate);
  int32_t u = sum.whole();
  if (in.setpoint_rate) u += in.setpoint_rate > 0 ? gains.kc : -gains.kc;

  output_ = held(gains, u);
  if (!(u > output_ && grown > 0) && !(u < output_ && grown < 0)) {
    integral_ = integral;
    carry_ = static_cast<uint8_t>(grown);
  }
  return output_;
}

}  // namespace flexura
