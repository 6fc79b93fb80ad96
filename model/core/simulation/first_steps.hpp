// When "auto" holds no race: what can be told of one robot, whether it runs alone or in a pack.
#pragma once
#include "simulation/method_by_name.hpp"

namespace flexura {

// Explicit steps for sure: a sharp tolerance, or a rigid robot without gains or friction.
template <class Number>
bool explicit_without_trial(double rtol, bool bends, int joints, const Inputs &acting,
                            Number resistance) {
  if (rtol < SHARPEST) return true;
  if (bends) return false;
  for (int i = 0; i < joints; ++i) {
    const JointDrive &d = acting.joints[std::size_t(i)];
    if (resistance(i) > 0.0 || (d.follows() && !d.prescribed && (d.kp > 0.0 || d.kd > 0.0)))
      return false;
  }
  return true;
}

// The first exponential steps of a run. If the rest takes no more of them than the trials of the
// other methods would take passes, they have no rival. What is counted are a robot's own attempts,
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
