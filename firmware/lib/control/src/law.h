// The law of one joint, an extended PID, written once for every kind of number.
//
//   u = kp e + ki sum(e) T + kd (r' - q') + tip + kv r' + kc sign(r'),   tip = kf w + kg w'       e = r - q, w = tip deflection
//
// q' and w' are filtered differences, T = 1 tick. |u| <= limit, then |u - u of the tick before| <= slew. The sum's part of u stays
// within the limit too, and stands still while limit or slew holds u back and e would push it further.
//
// The board calculates in integers (pid.h). The simulation has the same law in floating point: model/core/controller.cpp. What
// differs is in `Numbers`:
//   Output, Wish, Gains, Signals    u as it is given, u before its limits, and what update() takes
//   Sum                             of products: add, add_long, whole() as a Wish, top() in units of the limit
//   error(gains, signals)           e as a factor of kp and ki
//   difference(a, b), narrow(wish)  a - b; a Wish as an Output
#pragma once

namespace flexura {

template <class Numbers>
class Law {
 public:
  using Output = typename Numbers::Output;
  using Wish = typename Numbers::Wish;
  using Gains = typename Numbers::Gains;
  using Signals = typename Numbers::Signals;
  using Sum = typename Numbers::Sum;

  void start(Output output) { integral_ = Sum(), output_ = output; }
  Output update(const Gains &gains, const Signals &in);
  // Without the law: brings the output to a wish, within limit and slew.
  Output follow(const Gains &gains, Wish wish) { return output_ = held(gains, wish); }
  Output output() const { return output_; }

 private:
  Output held(const Gains &gains, Wish wish) const;
  static Output within(Output least, Output value, Output most) { return value < least ? least : value > most ? most : value; }

  Sum integral_;
  Output output_ = 0;
};

template <class Numbers>
typename Numbers::Output Law<Numbers>::held(const Gains &gains, Wish wish) const {
  const Output limited = within(static_cast<Output>(-gains.limit), Numbers::narrow(wish), gains.limit);
  return within(static_cast<Output>(output_ - gains.slew), limited, static_cast<Output>(output_ + gains.slew));
}

template <class Numbers>
typename Numbers::Output Law<Numbers>::update(const Gains &gains, const Signals &in) {
  const auto error = Numbers::error(gains, in);

  Sum integral = integral_;
  if (gains.ki) integral.add_long(gains.ki, error);
  if (integral.top() >= gains.limit || integral.top() < -gains.limit) integral = integral_;

  Sum sum(integral.whole());
  sum.add(in.tip);
  sum.add(gains.kp, error);
  if (gains.kd) sum.add(gains.kd, Numbers::difference(in.setpoint_rate, in.rate));
  sum.add(gains.kv, in.setpoint_rate);
  Wish u = sum.whole();
  if (in.setpoint_rate) u += in.setpoint_rate > 0 ? gains.kc : -gains.kc;

  output_ = held(gains, u);
  const bool pushes_up = (error < 0) == (gains.ki < 0);
  if (!(u > output_ && pushes_up) && !(u < output_ && !pushes_up)) integral_ = integral;
  return output_;
}

// kf w + kg w', what a strip's deflection and its rate add to u.
template <class Sum, class Gain, class Signal>
auto strip_term(Gain kf, Gain kg, Signal deflection, Signal rate) -> decltype(Sum().value()) {
  Sum sum;
  sum.add(kf, deflection);
  sum.add(kg, rate);
  return sum.value();
}

}  // namespace flexura
