#include "simulation/method_by_name.hpp"

#include <cstdio>

#include "integration/exponential/exponential.hpp"
#include "integration/runge_kutta/dop853.hpp"
#include "integration/runge_kutta/embedded_pairs.hpp"
#include "integration/runge_kutta/implicit.hpp"

namespace flexura {

template <class Real>
std::unique_ptr<Method<Real>> make_method(const std::string &name, Integration<Real> &integration,
                                          double rtol, const ExponentialOptions &options) {
  if (name == "explicit") return std::make_unique<Explicit<Real>>(integration);
  if (name == ESDIRK_4.name) return std::make_unique<Implicit<Real>>(integration);
  if (name == TR_BDF2.name) return std::make_unique<Implicit<Real>>(integration, TR_BDF2);
  if (name == "exponential") return std::make_unique<Exponential<Real>>(integration, rtol, options);
  if constexpr (LanesOf<Real>::value == 1) {  // sampled controllers run alone
    if (name == PAIR_3.name) return std::make_unique<EmbeddedPairSteps<Real>>(integration, PAIR_3);
    if (name == PAIR_5.name) return std::make_unique<EmbeddedPairSteps<Real>>(integration, PAIR_5);
  }
  return nullptr;
}

const char *method_for_ticks(double rate_Hz, double fastest, double rtol) {
  if (rtol < SHARPEST) return "explicit";
  if (fastest > 2.0 * Explicit<double>::STABLE * rate_Hz)
    return rtol >= LOOSE ? TR_BDF2.name : ESDIRK_4.name;  // explicit steps would be many a tick
  return rtol >= 1e-6 ? PAIR_3.name : PAIR_5.name;
}

template std::unique_ptr<Method<double>> make_method(const std::string &, Integration<double> &,
                                                     double, const ExponentialOptions &);
template std::unique_ptr<Method<Pack<4>>> make_method(const std::string &, Integration<Pack<4>> &,
                                                      double, const ExponentialOptions &);

namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

// Where the error was worst.
std::string place(const RunState &c) {
  if (c.joint < 0) return "the robot";
  const std::string i = std::to_string(c.joint + 1);
  if (c.elastic) return (c.rate ? "the rate of bending of link " : "the bending of link ") + i;
  return (c.rate ? "the speed of joint " : "the position of joint ") + i;
}

}  // namespace

std::string explain(const RunState &c, const std::string &method, double rtol) {
  const std::string at = " at t = " + number(c.t) + " s";
  switch (c.status) {
    case Status::running: return "the run goes on" + at;
    case Status::done: return "the run is complete";
    case Status::limit: return "joint " + std::to_string(c.joint + 1) + " meets its limit" + at;
    case Status::interrupted: return "the run was interrupted" + at;
    case Status::exhausted:
      return "the budget of " + std::to_string(c.steps + c.rejected) + " steps is used up" + at +
             ": allow more steps, a larger rtol than " + number(rtol) +
             ", or another method than \"" + method + "\"";
    case Status::diverged:
      return "the motion is not a finite number beyond t = " + number(c.t) + " s; first in " +
             place(c) + ": look for a force or a function that is not finite there";
    case Status::stuck:
      return "the run got no further than t = " + number(c.t) + " s: there " + place(c) +
             " changes faster than steps of " + number(c.step) +
             " s follow with rtol = " + number(rtol) +
             ": a force or gain is too large, or a motion ends there";
  }
  return "";
}

}  // namespace flexura
