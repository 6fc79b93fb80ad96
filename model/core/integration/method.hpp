// A method of the time loop, and what it shares with the loop.
//
// All lanes of a pack step at once, each with its own time and its own length of step, so that what
// a robot does never depends on which robots it shares a pack with. A lane that is done takes steps
// of length 0.
#pragma once
#include <limits>
#include <vector>

#include "control/drive_forces.hpp"
#include "control/plant.hpp"
#include "integration/error_norm.hpp"

namespace flexura {

template <class Real>
struct Integration {
  Plant<Real> &plant;
  DriveForces<Real> acts;
  ErrorNorm<Real> weights;
  const int n, size;  // unknowns; numbers of a state z = (q, v, accounts)
  std::vector<Real> z,
      znew;  // the state at the start of the step, and the one proposed for its end
  std::vector<Real>
      error;  // (size) the error estimate of the last attempt, to say where it was worst
  std::vector<Real> scratch;  // (n)
  long passes = 0;
  double end = 0.0;      // of the run [s]
  bool balanced = true;  // are the accounts of states within a step asked for?

  Integration(Plant<Real> &robot, Inputs *const *acting, double rtol)
      : plant(robot),
        acts(robot, acting),
        weights(robot, rtol),
        n(robot.n),
        size(2 * robot.n + ACCOUNTS),
        z(padded(size), Real(0.0)),
        znew(padded(size), Real(0.0)),
        error(padded(size), Real(0.0)),
        scratch(padded(robot.n), Real(0.0)) {}

  // dz/dt at a state at time t; prescribed joints are put on their motion in z.
  void slope(const Real &t, Real *state, Real *dz) {
    Real *q = state, *v = state + n;
    acts.at(t);
    acts.prescribe(q, v);
    acts.load(q, v);
    plant.accelerate(acts.pass(q, v, q, v, Real(0.0), Real(0.0)), dz + n, acts.reaction.data());
    for (int k = 0; k < n; ++k) dz[k] = v[k];
    rates(q, v, dz + 2 * n);
    ++passes;
  }

  // The reactions of prescribed joints at a state, `acts` being loaded for it.
  void react(const Real *q, const Real *v) {
    plant.accelerate(acts.pass(q, v, q, v, Real(0.0), Real(0.0)), scratch.data(),
                     acts.reaction.data());
    ++passes;
  }

  const Inputs &acts_of(int lane_) const { return acts.acting(lane_); }

  // The rates of the accounts (100), after the pass that `acts` was loaded for.
  void rates(const Real *q, const Real *v, Real *account) {
    plant.powers(q, v, account[STRAIN], account[LOSS]);
    account[WORK] = acts.work(q, v);
    account[LOSS] += acts.friction(v);
    account[NUMERICAL] = Real(0.0);
  }
};

// What may be said about the method "exponential".
struct ExponentialOptions {
  bool damping = true;  // of fast modes
  double zeta = 0.05;   // its ratio
  double cutoff = 0.0;  // [rad/s]; 0: from the tolerance
};

template <class Real>
class Method {
 public:
  static constexpr int LANES = LanesOf<Real>::value;

  explicit Method(Integration<Real> &shared) : c(shared) {}
  virtual ~Method() = default;
  virtual const char *name() const = 0;

  // The state c.z of the lanes `which` (1 or 0) at time t is new, or what acts has jumped there:
  // forget the past, look at the equations. Called before the first step, at each break, and when
  // the loop goes over to this method.
  virtual void begin(const Real &which, const Real &t) = 0;

  // Steps from c.z at t, of length h, to c.znew. Nothing is read later than `last`: the instant
  // before the break at which the step may end. Gives the error over the tolerance: below 1 the
  // step is good. REFUSED or what is not a number: it failed.
  virtual Real attempt(const Real &t, const Real &h, const Real &last) = 0;

  // The loop takes the step of the lanes `which`. Called before it moves c.znew to c.z.
  virtual void accept(const Real &which) = 0;

  // What `between` needs beyond the step just attempted, which some lane accepts; then the state at
  // the fraction x of that step.
  virtual void prepare(const Real &t, const Real &h, const Real &last) = 0;
  virtual void between(const Real &h, const Real &x, Real *state) = 0;

  // The first step to try, from the length that the loop proposes (where begin() follows a break:
  // the step before it).
  virtual double restart(int lane, double wish, bool first) {
    return (void)lane, (void)first, wish;
  }

  // The length of the next step: `wish` is what the error allows, `left` what remains to the next
  // break, `ahead` to the next output. Give `left` itself to end there.
  virtual double fit(int lane, double wish, double left, double ahead) {
    (void)lane, (void)ahead;
    return left <= 1.000001 * wish ? left : left < 1.5 * wish ? 0.5 * left : wish;
  }

  // The wish after a step of length h with that error (84); `accepted`: it was taken. `before`:
  // the error of the step before.
  virtual double next(int lane, double h, double error, double before, bool accepted) {
    (void)lane;
    const double order = power();
    if (!accepted)
      return error < 1e5 ? h * larger(0.2, 0.9 * flexura::power(error, -1.0 / order)) : 0.25 * h;
    if (error < 1e-12) return 5.0 * h;
    return h * smaller(5.0, larger(0.3, 0.9 * flexura::power(error, -0.7 / order) *
                                            flexura::power(before, 0.3 / order)));
  }

  static constexpr double REFUSED = 1e6;

 protected:
  virtual double power() const = 0;  // the error goes with this power of h
  Integration<Real> &c;
};

}  // namespace flexura
