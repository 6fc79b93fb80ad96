// What the time loop sees of a robot: how many unknowns, which are whose, accelerations, powers.
// `model_plant.hpp` makes one of a Model; tests make others. With Real = Pack<N> it is N robots of
// one topology.
//
// The state is z = (q, v, accounts): q (n) all unknowns, v (n) their rates, and integrals over time
// that are kept with them.
#pragma once
#include <memory>
#include <vector>

#include "dynamics/places/load_place.hpp"
#include "numbers/scalars.hpp"

namespace flexura {

// Integrals over time, under the same error control as the motion but for STRAIN [J].
enum Account { WORK, LOSS, NUMERICAL, STRAIN, ACCOUNTS };
// WORK of the drives and the loads; LOSS to friction and to the material's damping; NUMERICAL: what
// the method itself takes out on purpose; STRAIN: the rise of the strain energy.

// A pass that a plant is asked for: linear terms at ys + gq a, vs + gv a, all else at (q, v). Plain
// forward dynamics has ys = q, vs = v, gq = gv = 0.
template <class Real>
struct PassInputs {
  const Real *q, *v, *ys, *vs;  // (n)
  Real gq, gv;
  const Real *force;  // (n) generalised forces
  const Real *stiffness,
      *damping;  // (joints) gains, linear about 0; the robot's own viscous friction comes on top
  const char *held;   // (joints) accelerations are given, reactions come out
  const Real *given;  // (joints)
};

template <class Real>
struct Plant {
  int n = 0, joints = 0;
  std::vector<int>
      first;  // (joints + 1) row of joint i's position; its link's elastic unknowns follow it
  std::vector<bool> locked;            // (joints)
  std::vector<Real> viscous, coulomb;  // (joints) friction c eta' + f tanh(eta' / slow)
  double slow = 1e-3;                  // [rad/s or m/s]
  std::vector<Real>
      lever;  // (n) metres that a tip moves a unit of an unknown, at most: what an error weighs
  std::vector<Real> deflect;  // (n) metres that the tip of its own link deflects; 0 for joints
  std::vector<Real> travel;  // (joints) a way of joint i after which modes may be others; 0: as far
                             // as its lever says; or empty
  bool rides = false;      // does a slider move along a link that moves through a sleeve? Its modes
                           // then change from step to step
  Real reach = Real(1.0);  // length of the whole robot [m]

  virtual ~Plant() = default;
  // Accelerations a (n), and reactions (joints) of held joints: the force that a drive must give
  // there, viscous friction included.
  virtual void accelerate(const PassInputs<Real> &pass, Real *a, Real *reaction) = 0;
  // The rate of the strain energy (K q) . q', and the power lost to the material's damping [W].
  virtual void powers(const Real *q, const Real *v, Real &strain, Real &loss) = 0;
  // Strain energy [J]; (K q) . q is twice that if K is constant.
  virtual Real strain(const Real *q) {
    Real twice, unused;
    powers(q, q, twice, unused);
    return 0.5 * twice;
  }
  // Kinetic and strain energy [J].
  virtual Real energy(const Real *q, const Real *v) = 0;
  // The largest angular frequency or rate of decay at q with the gains of `pass` [1/s], from above:
  // what limits explicit steps.
  virtual Real fastest(const Real *q, const PassInputs<Real> &pass) = 0;
  // For methods that step in modes, of robot `lane` at q: the mass, the stiffness and the damping
  // of the links' material (n, n) each, row by row, joints' friction not included. False: not known
  // (matrices_by_passes.hpp then finds them from passes).
  virtual bool matrices(int lane, const Real *q, double *M, double *K, double *D) {
    return (void)lane, (void)q, (void)M, (void)K, (void)D, false;
  }
  // What a mode must not change if it is to be damped: the tips' deflections (joints), then x, y of
  // the last tip [m]; room for joints + 2. False: not known, then no mode is damped.
  virtual bool observe(int lane, const Real *q, double *out) {
    return (void)lane, (void)q, (void)out, false;
  }
  // Adds the generalised forces of loads on links at q to `out` (n): of each its force's two
  // components and its moment, `values` (count, 3) (133). Packs of robots have no loads.
  virtual void add_loads(const LoadPlace *places, int count, const Real *values, const Real *q,
                         Real *out) {
    (void)places, (void)count, (void)values, (void)q, (void)out;
  }
  // A joint that stands where it cannot be beyond its own limits, or -1; of robot `lane`.
  virtual int blocked(int lane, const Real *q) const { return (void)lane, (void)q, -1; }
};

}  // namespace flexura
