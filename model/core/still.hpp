// A chain at rest whose joints are held, or free to turn: what its energy, its gradient and its tangent need, with the places of sliders
// and sleeves put in once. Then every piece is of one kind: with e_j = (cos, sin) Theta_j at its points and Theta_j of (1),
//
//     next hub:  r + sum_j w_j e_j,  angle + sum_k a_k q_k                        (2)
//     first moment of its mass about the hub:  sum_j s_j e_j  (+ s_0 e(phi) of the rod behind a sleeve)
//     strain energy:  1/2 q . K q                                                  (5)
//
// and the potential energy of the chain under gravity g and a dead load at the last tip (force F in the base's axes, moment T) is
//
//     V = sum over pieces of [1/2 q . K q - g . (m r + sum_j s_j e_j)] - F . r_tip - T angle_tip.
//
// The Newton step on V is found by two sweeps. Inward, V beyond a hub is A/2 (u, u) + b . u in the hub's motion u = (x, y, angle), all
// that lies beyond already at its best. A piece adds J^T A J, J^T b (J: the next hub's motion by turning and q) and its K; since
// r'' = -e_j Theta'_j^2, the true force f on the next hub and gravity add, for each point, (s_j g - w_j f) . e_j Theta'_j Theta'_j. Its
// own rows are then eliminated by L D L^T; as many pivots are negative as directions in which V falls (Sylvester). The outward sweep
// gives the step. The cost is linear in the number of pieces.
#pragma once
#include <vector>

#include "model.hpp"

namespace flexura {

// A dead load at the last tip: it keeps its direction in the base's axes [N], [N m].
struct TipLoad {
  double force[2] = {0.0, 0.0}, moment = 0.0;
};

// A piece with everything but its hub's angle and its own unknowns put in.
struct StillPiece {
  int m = 0, P = 0, own = 0;
  int joint = -1;                       // row of a joint that is free to turn, or -1
  double angle = 0.0;                   // that its hub adds to the angle of the piece before, held joint included
  double mass = 0.0, rod = 0.0;         // rod: s_0
  const double *B = nullptr;            // (m, P), padded
  std::vector<double> w, s, a, K;       // (P), (P), (m), (m, m)
  std::vector<double> sine, cosine;     // of Theta at the points, at the state of the last `energy`
  double hub_sine = 0.0, hub_cosine = 1.0;
  std::vector<double> J;                // (3, m + 1): motion of the next hub by turning and own unknowns
  std::vector<double> L, D, tail;       // factors of the own rows; (m, 4): coupling with x, y, angle and the gradient
  double joint_pull[3] = {0.0, 0.0, 0.0}, joint_pivot = 0.0, joint_rest = 0.0;
};

class Still {
public:
  // Joints at their positions in q (n). `free` (links) or null: which revolute joints find their own place.
  Still(const Model<double> &model, const double *q, const char *free);

  // V at q under `share` of gravity and load; size: the sum of the sizes of its parts, for round-off.
  double energy(const double *q, const TipLoad &load, double share, double &size);

  // The Newton step from the state of the last `energy`: step (n, held joints 0), how many pivots are not positive. `slope`: the
  // gradient times the step. With `descend`, pivots that are not positive are turned round, so that the step goes down anyway.
  int newton(const double *q, const TipLoad &load, double share, bool descend, double *step, double &slope);

  double turn(const double *step) const;     // the largest change of angle of a point that a step makes [rad]
  Vec3<double> tip() const { return tip_; }  // place and angle of the last tip at the state of the last `energy`

private:
  std::vector<StillPiece> pieces_;
  int n_;
  double gravity_[2], base_ = 0.0;  // base_: place of a slider on the base's rail
  Vec3<double> tip_{0.0, 0.0, 0.0};
};

}  // namespace flexura
