#include "simulation/first_steps.hpp"

#include <algorithm>

#include "integration/runge_kutta/dop853.hpp"
#include "simulation/method_by_name.hpp"

namespace flexura {
namespace {

bool follows_with_gains(const JointDrive &d) {
  return d.follows() && !d.prescribed && (d.kp > 0.0 || d.kd > 0.0);
}

// Has a joint friction or gains?
bool resists(const Integration<double> &run) {
  for (int i = 0; i < run.plant.joints; ++i) {
    const std::size_t joint = std::size_t(i);
    if (larger(run.plant.viscous[joint], run.plant.coulomb[joint]) > 0.0 ||
        follows_with_gains(run.acts_of(0).joints[joint]))
      return true;
  }
  return false;
}

// The largest rate at which gains and friction of a joint would stop it, its link's bending free
// [1/s].
double strongest_damper(Integration<double> &run, double t) {
  const double *q = run.z.data(), *v = q + run.n;
  run.acts.at(t), run.acts.load(q, v);
  const std::vector<double> still(std::size_t(run.n), 0.0);
  std::vector<double> force(still), rest(still), moved(still),
      reaction(std::size_t(run.plant.joints), 0.0);
  PassInputs<double> pass = run.acts.pass(q, still.data(), q, still.data(), 0.0, 0.0);
  pass.force = force.data();
  run.plant.accelerate(pass, rest.data(), reaction.data());
  double most = 0.0;
  for (int i = 0; i < run.plant.joints; ++i) {
    const std::size_t joint = std::size_t(i), row = std::size_t(run.plant.first[joint]);
    const double resistance =
        pass.damping[joint] + run.plant.viscous[joint] + run.plant.coulomb[joint] / run.plant.slow;
    if (pass.held[joint] || !(resistance > 0.0)) continue;
    force[row] = 1.0;
    run.plant.accelerate(pass, moved.data(), reaction.data());
    force[row] = 0.0, most = std::max(most, resistance * (moved[row] - rest[row]));
  }
  return most;
}

}  // namespace

double fastest(Integration<double> &run, double t) {
  const double *q = run.z.data(), *v = q + run.n;
  run.acts.at(t), run.acts.load(q, v);
  return run.plant.fastest(q, run.acts.pass(q, v, q, v, 0.0, 0.0));
}

bool strongly_damped(Integration<double> &run, double t) {
  return strongest_damper(run, t) > STRONG;
}

bool explicit_is_slower(Integration<double> &run, double t, double speed) {
  return Explicit<double>::STABLE < 12.0 * speed * fastest(run, t);
}

const char *method_without_trial(Integration<double> &run, double t, double rtol) {
  const bool bends = run.n > run.plant.joints, sharp = rtol < SHARPEST;
  if (sharp ? !bends || !explicit_is_slower(run, t, 1.0 / DEAR) : !bends && !resists(run))
    return "explicit";
  if (!run.acts_of(0).sampler && bends && !sharp && strongly_damped(run, t)) return "implicit";
  return nullptr;
}

}  // namespace flexura
