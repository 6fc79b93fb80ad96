// The extended PID of one joint: one law, in the board's integers and in the model's doubles (numbers.h).
//
//   u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + kv r' + kc sign(r')        e = r - q, w = tip deflection
//
// q' and w' are filtered differences (filter.h, tip.h), T = 1 tick. |u| <= limit, then |u - u of the tick before| <= slew.
// The sum's part of u stays within the limit too, and stands still while limit or slew holds u back and e would push it further.
#pragma once
#include "numbers.h"

namespace flexura {

// u is in 1/16 PWM counts for joint 1, in 1/4096 microsteps per tick for joint 2: 16 bits hold it, and the sum of two of it.
// "count" stands for either joint's unit of position.
constexpr int16_t kOutputMost = 16383;

// Scales of the board; in the model all is in SI units, ki times the tick, and `fine` means nothing.
template <class N>
struct GainsOf {
  bool fine = false;            // errors are taken in 1/16 counts, and end at 2047 counts; else in counts, and end at 32767
  typename N::Gain kp = 0;      // Q16, u per unit of error
  typename N::Gain ki = 0;      // Q32, u per unit of error and tick
  typename N::Gain kd = 0;      // Q8, u per (count / tick)
  typename N::Gain kf = 0;      // Q16, u per 10 um
  typename N::Gain kg = 0;      // Q8, u per (10 um / two ticks)
  typename N::Gain kv = 0;      // Q8, u per (count / tick)
  typename N::Value kc = 0;     // u
  typename N::Value limit = 0;  // u, at most kOutputMost
  typename N::Value slew = 0;   // u per tick, the same
};

template <class N>
struct SignalsOf {
  typename N::Wide error;           // counts / 256
  typename N::Value rate;           // q', counts / 256 per tick
  typename N::Value setpoint_rate;  // r', the same
  typename N::Wide tip;             // what the strip adds to u, Q16: tip_term(), renewed every second tick
};

template <class N>
class PidOf {
 public:
  using Value = typename N::Value;
  using Wide = typename N::Wide;
  using Sum = typename N::Sum;

  void start(Value output) { integral_ = Sum(), output_ = output; }
  Value update(const GainsOf<N> &gains, const SignalsOf<N> &in);
  // Without a controller: brings the output to a wish, within limit and slew.
  Value follow(const GainsOf<N> &gains, Wide wish) { return output_ = held(gains, wish); }
  Value output() const { return output_; }

 private:
  Value held(const GainsOf<N> &gains, Wide wish) const;

  Sum integral_;          // Q32, u
  Value output_ = 0;
};

template <class N>
typename N::Value PidOf<N>::held(const GainsOf<N> &gains, Wide wish) const {
  const Value limited = clamp<Value>(N::narrowed(wish), static_cast<Value>(-gains.limit), gains.limit);
  return clamp<Value>(limited, static_cast<Value>(output_ - gains.slew), static_cast<Value>(output_ + gains.slew));
}

template <class N>
typename N::Value PidOf<N>::update(const GainsOf<N> &gains, const SignalsOf<N> &in) {
  const Value error = N::error(in.error, gains.fine);

  Sum integral = integral_;
  if (gains.ki != 0) integral.add_long(gains.ki, error);
  if (N::outside(integral, gains.limit)) integral = integral_;

  Sum sum(integral.whole());
  sum.add(in.tip);
  sum.add(gains.kp, error);
  if (gains.kd != 0) sum.add(gains.kd, N::difference(in.setpoint_rate, in.rate));
  sum.add(gains.kv, in.setpoint_rate);
  Wide u = sum.whole();
  if (in.setpoint_rate != 0) u += in.setpoint_rate > 0 ? gains.kc : -gains.kc;

  output_ = held(gains, u);
  const bool pushes_up = (error < 0) == (gains.ki < 0);
  if (!(u > output_ && pushes_up) && !(u < output_ && !pushes_up)) integral_ = integral;
  return output_;
}

using PidGains = GainsOf<BoardNumbers>;
using PidSignals = SignalsOf<BoardNumbers>;
using Pid = PidOf<BoardNumbers>;
extern template class PidOf<BoardNumbers>;  // pid.cpp

// kf w + kg w', Q16 of u; deflection [10 um], its rate [10 um / 256 in two ticks].
int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate);

}  // namespace flexura
