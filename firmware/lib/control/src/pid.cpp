#include "pid.h"

namespace flexura {

int32_t Pid::held(const PidGains &gains, int32_t wish) const {
  const int32_t limited = clamp(wish, -gains.limit, gains.limit);
  return clamp(limited, subtract(output_, gains.slew), add(output_, gains.slew));
}

int32_t Pid::update(const PidGains &gains, const PidSignals &in) {
  const int16_t counts = narrow(in.error >> 8);
  const uint8_t part = static_cast<uint8_t>(in.error);
  // 24 bits of a gain times 8 bits of a fraction of a count.
  const int32_t below = (gains.kp >> 8) * static_cast<int32_t>(part);

  const int32_t grown = add(multiply(gains.ki, narrow(add(in.error, 128) >> 8)), carry_);
  const int32_t integral = add(integral_, grown >> 8);

  int32_t u = add(add(multiply(gains.kp, counts), below), integral);
  u = add(u, multiply(gains.kd, narrow(static_cast<int32_t>(in.setpoint_rate) - in.rate)));
  u = add(u, multiply(gains.kf, in.deflection));
  u = add(u, multiply(gains.kg, in.deflection_rate));
  u = add(u, multiply(gains.kv, in.setpoint_rate));
  if (in.setpoint_rate) u = add(u, in.setpoint_rate > 0 ? gains.kc : -gains.kc);

  output_ = held(gains, u);
  const bool held_low = u > output_, held_high = u < output_;
  if (!(held_low && grown > 0) && !(held_high && grown < 0)) {
    integral_ = integral;
    carry_ = static_cast<uint8_t>(grown);
  }
  return output_;
}

}  // namespace flexura
