#include "pid.h"

namespace flexura {

int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate) {
  Sum sum;
  sum.add(gains.kf, deflection);
  sum.add(gains.kg, rate);
  return sum.value();
}

int16_t Pid::held(const PidGains &gains, int32_t wish) const {
  const int16_t limited = clamp<int16_t>(narrow(wish), static_cast<int16_t>(-gains.limit), gains.limit);
  return clamp<int16_t>(limited, static_cast<int16_t>(output_ - gains.slew), static_cast<int16_t>(output_ + gains.slew));
}

int16_t Pid::update(const PidGains &gains, const PidSignals &in) {
  const int16_t error = gains.fine ? narrow(in.error >> 4) : narrow(in.error >> 8);

  Sum integral = integral_;
  if (gains.ki) integral.add_long(gains.ki, error);
  if (integral.top() >= gains.limit || integral.top() < -gains.limit) integral = integral_;

  Sum sum(integral.whole());
  sum.add(in.tip);
  sum.add(gains.kp, error);
  if (gains.kd) sum.add(gains.kd, narrow(static_cast<int32_t>(in.setpoint_rate) - in.rate));
  sum.add(gains.kv, in.setpoint_rate);
  int32_t u = sum.whole();
  if (in.setpoint_rate) u += in.setpoint_rate > 0 ? gains.kc : -gains.kc;

  output_ = held(gains, u);
  const bool pushes_up = (error < 0) == (gains.ki < 0);
  if (!(u > output_ && pushes_up) && !(u < output_ && !pushes_up)) integral_ = integral;
  return output_;
}

}  // namespace flexura
