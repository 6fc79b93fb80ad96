// What acts on one robot: drives of the joints, a sampled controller, a function of the caller's
// own, limits.
//
//     force_i = f_i(t) + held_i + g_i(t, q, q') + kp_i (r_i - eta_i) + kd_i (r'_i - eta'_i)
//
// (58). f_i and r_i are signals, held_i what the sampled controller holds since its last tick, g_i
// the caller's function. A joint may follow its motion r_i exactly instead (prescribed); then the
// force is what that takes.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "control/signal.hpp"
#include "dynamics/places/load_place.hpp"

namespace flexura {

// What a sampled controller holds from one tick to the next, an entry a joint.
struct SampledOutput {
  std::vector<double> force;  // [N m or N]
  std::vector<Segment>
      motion;  // to follow, by joints with JointDrive::sampled (a stepper's pulses)
};

// A sampled controller. The loop calls `tick` at t = start + k / rate, k = 0, 1, ..., once each, in
// order of time, whatever steps are rejected; q, v (n) is the state there. It changes what is held
// from t on. It is not called at the end of the run.
struct Sampler {
  virtual ~Sampler() = default;
  virtual void tick(long k, double t, const double *q, const double *v, SampledOutput &held) = 0;
};

// Adds forces (one a joint) at a state q, v (n). Called often, also again for times within a step,
// never before the step's start.
using ForceFunction =
    std::function<void(double t, const double *q, const double *v, double *force)>;

struct JointDrive {
  Signal force, motion;  // empty: none
  double kp = 0.0, kd = 0.0;
  bool prescribed = false;  // follows the motion exactly
  bool sampled = false;     // the motion is the sampled controller's, in place of the signal
  bool follows() const { return sampled || !motion.empty(); }
};

// A force and a moment on a point of a link: signals of the force's two components [N] and of the
// moment [N m]; empty: none.
struct PointLoad {
  LoadPlace place;
  Signal value[3];
};

struct Inputs {
  std::vector<JointDrive> joints;
  std::vector<PointLoad> loads;
  std::vector<double> low, high;  // limits [m or rad]
  ForceFunction function;         // empty: none
  Sampler *sampler = nullptr;
  double rate_Hz = 0.0;  // of the sampler, or of what holds the signals from step to step
  SampledOutput held;

  explicit Inputs(int count = 0)
      : joints(count),
        low(count, -std::numeric_limits<double>::infinity()),
        high(count, std::numeric_limits<double>::infinity()) {
    held.force.assign(count, 0.0);
    held.motion.assign(count, Segment{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0});
  }

  // Limits wider than given by the epsilon of (64), a billionth: a motion may end on one, and does
  // so up to round-off.
  void limit(int joint, double least, double most) {
    low[joint] = std::isfinite(least) ? least - 1e-9 * std::max(1.0, std::abs(least)) : least;
    high[joint] = std::isfinite(most) ? most + 1e-9 * std::max(1.0, std::abs(most)) : most;
  }

  Motion motion(int joint, double t) const {
    const JointDrive &d = joints[joint];
    return d.sampled ? evaluate(held.motion[joint], t) : evaluate(d.motion, t);
  }

  // The force of joint i in (58) that does not depend on the state: signal and what is held.
  double force(int joint, double t) const {
    return evaluate(joints[joint].force, t).y + held.force[joint];
  }

  std::vector<const Signal *> signals() const {
    std::vector<const Signal *> out;
    for (const JointDrive &d : joints) out.insert(out.end(), {&d.force, &d.motion});
    for (const PointLoad &load : loads)
      for (const Signal &value : load.value) out.push_back(&value);
    return out;
  }

  // The shortest period of the signals [s]: a step that is longer would see a wave at like phases
  // and take it for still.
  double shortest_period() const {
    double w = 0.0;
    for (const Signal *signal : signals())
      for (const Segment &g : *signal)
        if (g.A != 0.0) w = std::max(w, std::fabs(g.w));
    return w > 0.0 ? 6.283185307179586 / w : std::numeric_limits<double>::infinity();
  }

  // Times at which a signal jumps or kinks, ascending, each once.
  std::vector<double> breaks() const {
    std::vector<double> out;
    for (const Signal *signal : signals())
      for (const Segment &g : *signal) out.push_back(g.t0);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }
};

// A joint behind backlash: a contact that pushes it only where it is off a motion by more than half
// of the play.
//
//     force = -k (e -+ b/2) - c e'     |e| > b/2,   e = eta - r(t)
//     force = 0                        |e| <= b/2
struct Backlash {
  int joint = 0;  // from 0
  Signal motion;  // r, of the driving side
  double play = 0.0, stiffness = 0.0, damping = 0.0;
};

// The forces of such contacts for a robot whose joints have the rows `first`. The signals' breaks
// are no ends of steps.
ForceFunction backlash_forces(std::vector<Backlash> contacts, std::vector<int> first);

}  // namespace flexura
