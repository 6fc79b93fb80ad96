// Plants for tests of the time loop whose motion is known: unit masses on springs and dampers, each
// joint also a pendulum.
#pragma once
#include <cmath>

#include "control/plant.hpp"
#include "numbers/pack_lane.hpp"

namespace flexura {

// Joints with `elastic` further unknowns each. Every unknown k is a unit mass: q'' + damping q' +
// stiffness q
// + gravity sin q = force.
template <class Real>
struct Masses : Plant<Real> {
  std::vector<Real> stiffness, damping, gravity;
  long asked = 0;

  explicit Masses(int joints, int elastic = 0) {
    this->joints = joints, this->n = joints * (1 + elastic);
    for (int i = 0; i <= joints; ++i) this->first.push_back(i * (1 + elastic));
    this->locked.assign(joints, false);
    this->viscous.assign(joints, Real(0.0)), this->coulomb.assign(joints, Real(0.0));
    this->lever.assign(this->n, Real(1.0)), this->deflect = this->lever;
    for (int i = 0; i < joints; ++i) this->deflect[this->first[i]] = Real(0.0);
    stiffness.assign(this->n, Real(0.0)), damping = gravity = stiffness;
  }

  void accelerate(const PassInputs<Real> &p, Real *a, Real *reaction) override {
    ++asked;
    for (int i = 0; i < this->joints; ++i)
      for (int k = this->first[i]; k < this->first[i + 1]; ++k) {
        const bool joint = k == this->first[i];
        const Real s = joint ? stiffness[k] + p.stiffness[i] : stiffness[k],
                   d = joint ? damping[k] + p.damping[i] + this->viscous[i] : damping[k];
        Real sine, cosine;
        sincos(p.q[k], sine, cosine);
        const Real rest = p.force[k] - s * p.ys[k] - d * p.vs[k] - gravity[k] * sine;
        if (joint && p.held[i])
          a[k] = p.given[i], reaction[i] = a[k] + stiffness[k] * p.q[k] +
                                           (damping[k] + this->viscous[i]) * p.v[k] +
                                           gravity[k] * sine;
        else
          a[k] = rest / (1.0 + p.gq * s + p.gv * d);
      }
  }
  void powers(const Real *q, const Real *v, Real &strain, Real &loss) override {
    strain = loss = Real(0.0);
    for (int k = 0; k < this->n; ++k)
      strain += stiffness[k] * q[k] * v[k], loss += damping[k] * v[k] * v[k];
  }
  Real energy(const Real *q, const Real *v) override {
    Real sum = 0.0;
    for (int k = 0; k < this->n; ++k) sum += 0.5 * (v[k] * v[k] + stiffness[k] * q[k] * q[k]);
    return sum;
  }
  Real fastest(const Real *, const PassInputs<Real> &) override {
    Real most = 0.0;
    for (int k = 0; k < this->n; ++k) most = larger(most, larger(root(stiffness[k]), damping[k]));
    return most;
  }
};

}  // namespace flexura
