// The robot linearised about a configuration at rest: M(q), the tangent stiffness, natural
// frequencies and modes (54).
//
// The tangent stiffness is the derivative by q of all static forces: elastic, gravity, and a load
// that is held at the tip. In a bent equilibrium it has the geometric stiffness of what the links
// carry; a negative square of a frequency says that it is none.
#pragma once
#include <vector>

#include "dynamics/inverse_dynamics.hpp"
#include "statics_and_modes/potential_energy.hpp"

namespace flexura {

// M(q) (n, n) of (40), held joints and all: composite bodies (48). Positive definite at
// any bending.
void mass_matrix(const Model<double> &model, const double *q, double *M);

// d/dq (n, n) of what the static forces at q and the load at the tip leave: elastic - gravity -
// J_tip^T load. `v` (n) or null: about a steady motion of the joints at these rates instead, the
// forces of its motion included (centrifugal stiffening).
void stiffness_matrix(const Model<double> &model, const double *q, const double *v,
                      const TipLoad &load, double *K);

// d/dv (n, n) of the forces at (q, v): damping D, viscous friction, and the gyroscopic terms of a
// motion.
void rate_matrix(const Model<double> &model, const double *q, const double *v, double *D);

// out (n) += J_tip^T load, the generalised forces of a load at the last tip; after
// `outward_kinematics` at q.
template <class Real>
void add_tip_load(const Model<Real> &model, const Workspace<Real> &work, const TipLoad &load,
                  Real *out) {
  Vec3<Real> b{load.force[0], load.force[1], load.moment};  // on the next hub
  for (std::size_t i = model.pieces.size(); i-- > 0;) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    const int stride = padded(columns_of(c)), sleeve = c.joint == HubJoint::sleeve;
    auto meets = [&](int column) {
      return k.tip[column] * b.x + k.tip[stride + column] * b.y + k.tip[2 * stride + column] * b.t;
    };
    for (int l = 0; l < c.m; ++l) out[c.own() + l] += meets(1 + l);
    if (sleeve) out[c.first] += meets(c.m + 1);
    b.t = meets(0);
    if (c.joint != HubJoint::none && !sleeve) out[c.first] += dot(k.along, b);
  }
}

// Rows of the unknowns that move: the elastic ones, and the joints that `free` (links) names; null:
// all joints are held.
std::vector<int> moving_rows(const Model<double> &model, const char *free);

// Natural motions: squares (count) of w [rad^2/s^2], ascending; shapes (n, count), by columns, 0 in
// the rows of held joints, x . M x = 1, the largest component positive. Directions without mass are
// left out.
struct NaturalModes {
  int count = 0;
  std::vector<double> squares, shapes;

  // w / (2 pi) [Hz]; 0 where the square is negative, the motion unstable or held by nothing.
  std::vector<double> frequencies() const;
};

// The lowest `most` modes (54) at q (n) (all of them: most <= 0) under gravity and a load held at
// the tip. Few of many unknowns, joints held or revolute, are found in time proportional to the
// number of pieces
// (`lowest_modes`), others from the matrices. Without `shapes` only the squares are.
NaturalModes natural_modes(const Model<double> &model, const double *q, const char *free, int most,
                           const TipLoad &load = {}, bool shapes = true);

// Lanczos' method (55) with the operator (K + s M)^-1 M, by sweeps of `ChainAtRest`: of joints only
// revolute ones may be free. That no mode is missing is known from the pivots of K - x M: as many
// are negative as squares are below x (Sylvester's law).
NaturalModes lowest_modes(const Model<double> &model, const double *q, const char *free, int most,
                          const TipLoad &load = {}, bool shapes = true);

}  // namespace flexura
