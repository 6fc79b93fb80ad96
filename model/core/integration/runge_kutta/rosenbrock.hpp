// Steps of a given length at a cost that is known beforehand: the two-stage method of Rosenbrock's
// kind of Verwer, Spee, Blom and Hundsdorfer (1999, SIAM J. Sci. Comput. 20, ROS2), of order 2
// whatever the matrix in its stages, L-stable with the exact one (86).
//
// One pass a stage, no iteration, no error estimate, no memory of what was before: the state (q, v)
// is all that there is. Stiffness, damping and the joints' friction are in the stage's matrix;
// inertial forces, gravity and the links' changing place are not, which costs no order. A stage's
// own mass matrix is the one where it looks.
#pragma once
#include <vector>

#include "control/drive_forces.hpp"

namespace flexura {

template <class Real>
class Rosenbrock {
 public:
  static constexpr double GAMMA = 0.29289321881345247560;  // 1 - 1/sqrt 2

  Rosenbrock(Plant<Real> &robot, DriveForces<Real> &forces) : plant(robot), acts(forces) {
    for (auto *x : {&y, &rate, &q_end, &v_end, &turn, &first, &second})
      x->assign(std::size_t(padded(robot.n)), Real(0.0));
  }

  // A step of length h from q, v (n) to what is there after it, under the forces of the drives at
  // one time (`acts` being there) and the friction of the joints.
  void step(Real *q, Real *v, const Real &h) {
    const Real gh = GAMMA * h;
    const std::size_t n = std::size_t(plant.n);
    for (std::size_t k = 0; k < n; ++k) y[k] = q[k] + gh * v[k];
    look(q, v, y.data(), v, gh, first.data());
    for (std::size_t k = 0; k < n; ++k) {
      turn[k] = v[k] + gh * first[k];
      q_end[k] = q[k] + h * turn[k], v_end[k] = v[k] + h * first[k];
      rate[k] = v_end[k] - 2.0 * gh * first[k];
      y[k] = q_end[k] + gh * (rate[k] - 2.0 * turn[k]);
    }
    look(q_end.data(), v_end.data(), y.data(), rate.data(), gh, second.data());
    for (std::size_t k = 0; k < n; ++k) {
      const Real turned = rate[k] - 2.0 * turn[k] + gh * second[k];
      q[k] += h * (1.5 * turn[k] + 0.5 * turned);
      v[k] += h * (0.5 * (first[k] + second[k]));
    }
  }

 private:
  Plant<Real> &plant;
  DriveForces<Real> &acts;
  std::vector<Real> y, rate, q_end, v_end, turn, first, second;

  void look(const Real *q, const Real *v, const Real *ys, const Real *vs, const Real &gh, Real *a) {
    acts.load_stage(Real(1.0), q, v, true);
    plant.accelerate(acts.pass(q, v, ys, vs, gh * gh, gh), a, acts.reaction.data());
  }
};

}  // namespace flexura
