// What an error weighs: metres at the robot's tips over the tolerance, rtol times the size of what
// the run is asked for: (81), (82).
//
// That size is the largest deflection of a tip so far, or a thousandth of the tips' way, whichever
// is larger (81); for rates the same of their speeds. An error of unknown k moves a tip by at most
// lever_k. Errors are summed (root of squares) over a joint's position, over a link's elastic
// unknowns, over their rates, and the worst of these groups decides. Work and losses weigh by the
// largest energy so far.
#pragma once
#include <cmath>
#include <vector>

#include "control/plant.hpp"
#include "numbers/pack_lane.hpp"

namespace flexura {

// A group: joint `joint` or (elastic) its link's own unknowns, their values or rates.
struct ErrorLocation {
  int joint = -1;
  bool elastic = false, rate = false;
};

template <class Real>
class ErrorNorm {
 public:
  // The largest so far: deflection of a tip, way of the tips by the joints [m], their rates [m/s],
  // energy [J].
  struct Sizes {
    Real deflection, way, deflecting, speed, energy;
  };
  std::vector<Real> weight;  // (2 n) metres over the tolerance
  static constexpr double
      WAY = 1e-3,
      START = 1e-6;  // of the tips' way; of the robot's length, before anything has moved

  ErrorNorm(Plant<Real> &robot, double tolerance)
      : weight(padded(2 * robot.n), Real(0.0)),
        plant(robot),
        rtol(tolerance),
        n(robot.n),
        begun(n, Real(0.0)),
        largest{} {}

  // Forgets all sizes: a run begins at (q, v).
  void start(const Real *z) {
    // Every joint moves the tips at START of the robot's length a second; where it is locked, its
    // link's bending does.
    std::vector<Real> slow(n, Real(0.0));
    for (int i = 0; i < plant.joints; ++i) {
      const int e = plant.first[i];
      const bool locked = plant.locked[i];
      for (int k = e + locked; k < (locked ? plant.first[i + 1] : e + 1); ++k)
        slow[k] = plant.reach * START / plant.lever[k];
    }
    for (int k = 0; k < n; ++k) begun[k] = z[k];
    largest = {Real(0.0), Real(0.0), Real(0.0), Real(0.0), plant.energy(z, slow.data())};
    grow(z, Real(1.0));
    renew();
  }

  const Sizes &sizes() const { return largest; }
  void resume(const Sizes &from) { largest = from, renew(); }

  // Sizes (81) with the state z too; `weight` is 1 / tolerance of each number of a state. Where
  // `look` is 1 also with its energy, which takes as long as a pass.
  void grow(const Real *z, const Real &look) {
    const Sizes before = largest;
    Real way = 0.0, fast = 0.0;
    for (int i = 0; i < plant.joints; ++i) {
      const int e = plant.first[i], end = plant.first[i + 1];
      way += plant.lever[e] * abs(z[e] - begun[e]), fast += plant.lever[e] * abs(z[n + e]);
      Real bent = 0.0, bending = 0.0;
      for (int k = e + 1; k < end; ++k)
        bent += plant.deflect[k] * z[k], bending += plant.deflect[k] * z[n + k];
      largest.deflection = larger(largest.deflection, abs(bent)),
      largest.deflecting = larger(largest.deflecting, abs(bending));
    }
    largest.way = larger(largest.way, way), largest.speed = larger(largest.speed, fast);
    for (int k : {WORK, LOSS}) largest.energy = larger(largest.energy, abs(z[2 * n + k]));
    if (worst(look) > 0.0)
      largest.energy = choose_less(Real(0.5), look, larger(largest.energy, plant.energy(z, z + n)),
                                   largest.energy);
    if (grown(before)) renew();
  }

  // 1 / tolerance of the accounts of a step to znew [1/J].
  Real joules(const Real *znew) const {
    const Real sizes =
        larger(largest.energy, larger(abs(znew[2 * n + WORK]), abs(znew[2 * n + LOSS])));
    return 1.0 / (larger(sizes, Real(1e-280)) * rtol);
  }

  // The worst group of an error e (2 n + ACCOUNTS) of a step to znew, over its tolerance (82).
  // What is not a number stays so.
  Real norm(const Real *e, const Real *znew) const {
    const Real joule = joules(znew);
    Real most = 0.0;
    for (int half = 0; half < 2; ++half)
      for (int i = 0; i < plant.joints; ++i) {
        const int from = half * n + plant.first[i], end = half * n + plant.first[i + 1];
        most = larger(most, size(e, from, from + 1));
        if (end > from + 1) most = larger(most, size(e, from + 1, end));
      }
    for (int k : {WORK, LOSS, NUMERICAL}) most = larger(most, abs(e[2 * n + k] * joule));
    return most;
  }

  Real size(const Real *e, int from, int end) const {
    Real sum = 0.0;
    for (int k = from; k < end; ++k) {
      const Real x = e[k] * weight[k];
      sum += x * x;
    }
    return root(sum);
  }

  // Where the error e is worst for robot `which`.
  ErrorLocation worst_spot(const Real *e, int which) const {
    ErrorLocation spot;
    double most = -1.0;
    for (int half = 0; half < 2; ++half)
      for (int i = 0; i < plant.joints; ++i)
        for (int elastic = 0; elastic < 2; ++elastic) {
          const int from = half * n + plant.first[i],
                    end = elastic ? half * n + plant.first[i + 1] : from + 1;
          const double here = lane(size(e, from + elastic, end), which),
                       x = std::isfinite(here) ? here : 1e300;
          if (x > most) most = x, spot = {i, elastic != 0, half != 0};
        }
    return spot;
  }

 private:
  Plant<Real> &plant;
  double rtol;
  int n;
  std::vector<Real> begun;
  Sizes largest;

  // Has any size of a length or a speed grown, of any robot?
  bool grown(const Sizes &before) const {
    const Real by =
        larger(larger(largest.deflection - before.deflection, largest.way - before.way),
               larger(largest.deflecting - before.deflecting, largest.speed - before.speed));
    return !(worst(by) <= 0.0);
  }

  void renew() {
    const Real place = larger(larger(largest.deflection, largest.way * WAY), plant.reach * START);
    const Real rate = larger(larger(largest.deflecting, largest.speed * WAY), plant.reach * START);
    const Real place_weight = 1.0 / (place * rtol), rate_weight = 1.0 / (rate * rtol);
    for (int k = 0; k < n; ++k)
      weight[k] = plant.lever[k] * place_weight, weight[n + k] = plant.lever[k] * rate_weight;
  }
};

}  // namespace flexura
