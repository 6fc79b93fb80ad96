// When "auto" compares no methods. One robot and a robot in a pack ask the same functions.
#pragma once
#include "integration/method.hpp"
#include "integration/run_state.hpp"

namespace flexura {

// DEAR: passes a second of explicit steps beyond which a sharp tolerance is left to a comparison
// without exponential ones. STRONG: the rate at which a damper stops its joint [1/s] beyond which
// it couples the modes so much that only implicit steps are long.
constexpr double DEAR = 2e6, STRONG = 1000.0;

// The method that "auto" takes without a trial, "explicit" or "implicit"; null: a trial decides.
// The state is that of `run`, which starts at time t. Explicit steps are for sharp tolerances, and
// for rigid robots without gains or friction. Implicit ones are for strong dampers.
const char *method_without_trial(Integration<double> &run, double t, double rtol);

// The highest frequency or rate of decay at a run's state [rad/s].
double fastest(Integration<double> &run, double t);

// Are explicit steps, of 12 passes and as long as they may be, slower than `speed` [s a pass]?
bool explicit_is_slower(Integration<double> &run, double t, double speed);

// Would gains or friction of a joint stop it faster than STRONG, the bending of its link left free?
bool strongly_damped(Integration<double> &run, double t);

// The first exponential steps of a run. If the rest takes no more of them than the trials of the
// other methods would take passes, no other is tried. What is counted are a robot's own attempts,
// accepted or not.
struct FirstSteps {
  static constexpr long ATTEMPTS = 80, REST = 120;
  double half = 0.0;  // time after half of the attempts

  static long attempts(const RunState &c) { return c.steps + c.rejected; }

  // To be called after each attempt; is another one to be made before it can be told?
  bool look(const RunState &c) {
    if (attempts(c) <= ATTEMPTS / 2) half = c.t;
    return c.running() && attempts(c) < ATTEMPTS;
  }
  // Seconds an attempt, in the second half of them; -1: the run got stuck.
  double speed(const RunState &c) const {
    return c.status == Status::stuck || c.status == Status::diverged
               ? -1.0
               : (c.t - half) / (ATTEMPTS / 2);
  }
  bool settled(const RunState &c) const {
    if (!c.running())
      return c.status == Status::done || c.status == Status::limit ||
             c.status == Status::interrupted;
    return (c.end - c.t) * (ATTEMPTS / 2) <= REST * (c.t - half);
  }
};

}  // namespace flexura
