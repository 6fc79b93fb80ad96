// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The extended PID of one joint, with anti-windup.
//
// One law serves the board's integers and the model's doubles (numbers.h). In each tick k, with
// e = r - q, T = 1 tick and w = tip deflection:
//
//   i* = i_{k-1} + ki e T, or i_{k-1} if |i*| would pass the limit
//   u* = kp e + i* + kd (r' - q') + kf w + kg w' + ks s + kt s' + kv r' + kc sign(r') + f(t) + d^
//                                                                             (70), (150)
//   u  = saturation of u*: |u| <= limit, |u - u_{k-1}| <= slew                (71)
//   i_k = i*, or i_{k-1} if the saturation holds u back and e would push it further     (72)
//
// q' and w' are filtered differences (filter.h, flex_sensor.h), d^ is the observer's
// (disturbance_observer.h). The board has no tip slope s and no force f(t): ks, kt and f are the
// model's (control_law.cpp).
#pragma once
#include "numbers.h"

namespace flexura {

// u is in 1/16 PWM counts for joint 1 and in 1/4096 microsteps per tick for joint 2. 16 bits hold u
// and the sum of two of it. "count" stands for either joint's unit of position.
constexpr int16_t kOutputMax = 16383;
static_assert(2L * kOutputMax <= INT16_MAX, "16 bits hold the sum of two");

// The comments give the board's scales. In the model all is in SI units, ki is multiplied by the
// tick, and `fine` has no meaning.
template <class N>
struct GainsOf {
  bool fine = false;         // error in 1/16 counts, up to 2047 counts; else in counts, up to 32767
  typename N::Gain kp = 0;   // Q16, u per unit of error
  typename N::Gain ki = 0;   // Q32, u per unit of error and tick
  typename N::Gain kd = 0;   // Q8, u per (count / tick)
  typename N::Gain kf = 0;   // Q16, u per 10 um
  typename N::Gain kg = 0;   // Q8, u per (10 um / two ticks)
  typename N::Gain kv = 0;   // Q8, u per (count / tick)
  typename N::Value kc = 0;  // u
  typename N::Value limit = 0;  // u, at most kOutputMax
  typename N::Value slew = 0;   // u per tick, at most kOutputMax
};

template <class N>
struct SignalsOf {
  typename N::Wide error;           // e, counts / 256
  typename N::Value rate;           // q', counts / 256 per tick
  typename N::Value setpoint_rate;  // r', counts / 256 per tick
  // kf w + kg w' + d^, Q16 of u: added_terms(). In the model also ks s + kt s' + f(t).
  typename N::Wide added;
};

template <class N>
class PidOf {
 public:
  using Value = typename N::Value;
  using Wide = typename N::Wide;
  using Accumulator = typename N::Accumulator;

  void start(Value output) {
    integral_ = Accumulator();
    output_ = output;
  }
  Value update(const GainsOf<N> &gains, const SignalsOf<N> &in);
  // Tracks an output that another law gives, within limit and slew (bumpless transfer).
  Value track(const GainsOf<N> &gains, Wide unlimited) {
    return output_ = saturate(gains, unlimited);
  }
  Value output() const { return output_; }

 private:
  Value saturate(const GainsOf<N> &gains, Wide unlimited) const;

  Accumulator integral_;  // i, Q32 of u
  Value output_ = 0;      // u of the tick before
};

template <class N>
typename N::Value PidOf<N>::saturate(const GainsOf<N> &gains, Wide unlimited) const {
  const Value low = static_cast<Value>(-gains.limit);
  const Value limited = clamp<Value>(N::saturated(unlimited), low, gains.limit);
  return clamp<Value>(limited, static_cast<Value>(output_ - gains.slew),
                      static_cast<Value>(output_ + gains.slew));
}

// One tick of the law (70), with its limits (71) and anti-windup (72).
template <class N>
typename N::Value PidOf<N>::update(const GainsOf<N> &gains, const SignalsOf<N> &in) {
  const Value error = N::error(in.error, gains.fine);

  Accumulator integral = integral_;
  if (gains.ki != 0) integral.add_scaled(gains.ki, error);
  if (N::outside(integral, gains.limit)) integral = integral_;

  Accumulator sum(integral.integer_part());
  sum.add(in.added);
  sum.add(gains.kp, error);
  if (gains.kd != 0) sum.add(gains.kd, N::difference(in.setpoint_rate, in.rate));
  sum.add(gains.kv, in.setpoint_rate);
  Wide u = sum.integer_part();
  if (in.setpoint_rate != 0) u += in.setpoint_rate > 0 ? gains.kc : -gains.kc;

  output_ = saturate(gains, u);
  const bool pushes_up = (error < 0) == (gains.ki < 0);
  const bool pushes_on = (u > output_ && pushes_up) || (u < output_ && !pushes_up);
  if (!pushes_on) integral_ = integral;
  return output_;
}

using PidGains = GainsOf<BoardNumbers>;
using PidSignals = SignalsOf<BoardNumbers>;
using Pid = PidOf<BoardNumbers>;
extern template class PidOf<BoardNumbers>;  // pid.cpp

// kf w + kg w' + d^ as Q16 of u; deflection [10 um], its rate [10 um / 256 in two ticks],
// disturbance d^ as the observer gives it.
int32_t added_terms(const PidGains &gains, int16_t deflection, int16_t rate, int32_t disturbance);

}  // namespace flexura
