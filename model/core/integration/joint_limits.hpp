// The stop at a limit (64): the instant within a step at which a joint first leaves its limits, by
// bisection of the dense output.
#pragma once
#include <algorithm>
#include <cmath>

#include "integration/method.hpp"
#include "integration/run_state.hpp"

namespace flexura {

// A step from `begin` to `end`, and the outputs that may lie in it.
struct StepInterval {
  double begin, end;
  const double *output, *outputs_end;
};

template <class Real>
class JointLimits {
 public:
  JointLimits(Integration<Real> &shared, int which)
      : c(shared), acting(shared.acts_of(which)), k(which) {}

  // The time at which a joint is beyond its limits first, less than a part in 1e13 of the step
  // before; RunState::NEVER: none is. `at(t)` gives the state at a time in the step. (64) is looked
  // for at the step's end, at the outputs on its way and, where a joint turns round in the step, at
  // seven instants between.
  template <class At>
  double first_beyond(const StepInterval &step, int &joint, At at) const {
    double inside = step.begin, outside = RunState::NEVER;
    auto look = [&](double t) {
      if (outside < RunState::NEVER) return;
      (beyond(at(t)) >= 0 ? outside : inside) = t;
    };
    if (limited() && turns())
      for (int j = 1; j < 8; ++j) look(step.begin + (step.end - step.begin) * j / 8.0);
    else if (limited())
      for (const double *t = step.output; t < step.outputs_end && *t < step.end; ++t) look(*t);
    look(step.end);
    if (outside == RunState::NEVER) return outside;
    while (outside - inside > 1e-13 * (step.end - step.begin)) {
      const double middle = 0.5 * (inside + outside);
      if (!(inside < middle && middle < outside)) break;
      (beyond(at(middle)) >= 0 ? outside : inside) = middle;
    }
    joint = std::max(beyond(at(outside)), 0);
    return inside;
  }

 private:
  Integration<Real> &c;
  const Inputs &acting;
  int k;

  // A joint that is outside its limits in the state z, or -1.
  int beyond(const Real *z) const {
    for (int i = 0; i < c.plant.joints; ++i) {
      const double place = lane(z[c.plant.first[i]], k);
      if (!c.plant.locked[i] && !(acting.low[i] <= place && place <= acting.high[i])) return i;
    }
    return c.plant.blocked(k, z);
  }

  bool bounded(int i) const {
    return std::isfinite(acting.low[i]) || std::isfinite(acting.high[i]);
  }
  bool limited() const {
    for (int i = 0; i < c.plant.joints; ++i)
      if (bounded(i)) return true;
    return false;
  }

  // Does a joint with limits turn round within the step?
  bool turns() const {
    for (int i = 0; i < c.plant.joints; ++i) {
      const int e = c.n + c.plant.first[i];
      if (bounded(i) && lane(c.z[e], k) * lane(c.znew[e], k) < 0.0) return true;
    }
    return false;
  }
};

}  // namespace flexura
