// A chain at rest whose joints are held, or free to turn: its potential energy, the gradient of it,
// and its tangent, each in time proportional to the number of pieces. Places of sliders and sleeves
// are put in once; then every piece is of one kind. With e_j = (cos, sin) Theta_j at its points and
// Theta_j of (2),
//
//     next hub:  r + sum_j w_j e_j,  angle + sum_k a_k q_k                        (4)
//     first moment of its mass about the hub:  sum_j s_j e_j  (+ s_0 e(phi) of the rod behind a
//     sleeve) strain energy:  1/2 q . K q                                                 (9)
//
// and the potential energy under gravity g and a dead load at the last tip (force F in the base's
// axes, moment T) is
//
//     V = sum over pieces of [1/2 q . K q - g . (m r + sum_j s_j e_j)] - F . r_tip - T angle_tip.
//
// The tangent is the matrix of second derivatives of V, plus `shift` times M. It is factorised
// inward: V beyond a hub is A/2 (u, u) in the hub's motion u = (x, y, angle), all that lies beyond
// already at its best. A piece adds J^T A J (J: the next hub's motion by turning and q), its K, and
// since r'' = -e_j Theta'_j^2, for each point (s_j g - w_j f) . e_j Theta'_j Theta'_j, f the true
// force on the next hub. Its own rows are eliminated by L D L^T: as many pivots are negative as V
// has directions in which it falls (Sylvester's law).
#pragma once
#include <vector>

#include "robot/model.hpp"

namespace flexura {

// A dead load at the last tip: it keeps its direction in the base's axes [N], [N m].
struct TipLoad {
  double force[2] = {0.0, 0.0}, moment = 0.0;
  bool none() const { return force[0] == 0.0 && force[1] == 0.0 && moment == 0.0; }
};

// A piece with everything but its hub's angle and its own unknowns put in, and what the tangent
// leaves of it. Arrays are the model's, or lie in the memory of `ChainAtRest`.
struct PieceAtRest {
  int m = 0, P = 0, own = 0, squares = 0;  // squares: rows of R
  int joint = -1, held = -1;  // row of a joint that is free to turn, or that is held; -1: none
  double angle = 0.0;  // that its hub adds to the angle of the piece before, held joint included
  double mass = 0.0, rod = 0.0;  // [kg]; s_0 [kg m]
  double hub = 0.0, tip = 0.0;   // inertia of hub (with the rod behind) and payload [kg m^2]
  double rotor = 0.0, spring = 0.0, rest = 0.0;  // of a free joint
  const double *B, *w, *s, *a;                   // (m, P) padded, (P), (P), (m)
  const double *R;                               // (squares, P): W = R^T R (16)
  const double *spin = nullptr;                  // (m + 1, m + 1): lumped inertias, or null
  double *K;                                     // (m, m)
  double *sine, *cosine;                         // of Theta at the points
  double hub_sine = 0.0, hub_cosine = 1.0;
  double *J;                // (3, m + 1): motion of the next hub by turning and own unknowns
  double *inertia, *first;  // M of turning and own unknowns (m + 1, m + 1), with the hub (m + 1, 2)
  double *L, *D, *tail;     // (m, m), (m) inverse pivots, (m, 3): own rows with x, y, angle
  Vec3<double> pull{0.0, 0.0, 0.0};  // the same of a free joint, and its inverse pivot
  double inverse = 0.0;
};

class ChainAtRest {
 public:
  // Joints at their positions in q (n). `free` (links) or null: which revolute joints find their
  // own place. The model must outlive it.
  ChainAtRest(const Model<double> &model, const double *q, const char *free);
  ChainAtRest(const ChainAtRest &) = delete;

  // V at q under `share` of gravity and load; size: the sum of the sizes of its parts, for
  // round-off. What follows is at this q.
  double energy(const double *q, const TipLoad &load, double share, double &size);

  // Derivatives of V by q (n; 0 of held joints).
  void gradient(const double *q, const TipLoad &load, double share, double *out) const;

  // Factorises the tangent with `shift` M; returns how many pivots are not positive. With `descend`
  // these are turned round, so that a step against the gradient goes down anyway.
  int tangent(const TipLoad &load, double share, double shift, bool descend);

  // x = (tangent)^-1 r, r and x (n; entries of held joints are 0).
  void solve(const double *r, double *x) const;

  // M x (n; entries of held joints are 0).
  void mass_times(const double *x, double *out);

  // The largest change of angle of a point that a step makes [rad].
  double largest_turn(const double *step) const;

  Vec3<double> tip() const { return tip_; }  // place and angle of the last tip
  bool idle(const TipLoad &load) const {     // nothing but elastic forces acts
    return gravity_[0] == 0.0 && gravity_[1] == 0.0 && load.none();
  }

  // x . K x / x . M x of a shape near the lowest mode's: every piece bends as under a moment at its
  // end; 1 if nothing bends.
  double near_lowest();

 private:
  void weigh();  // `inertia` and `first` of all pieces

  std::vector<PieceAtRest> pieces_;
  std::vector<double> memory_;
  std::vector<Vec3<double>> wrenches_;
  int n_;
  bool weighed_ = false;
  double gravity_[2], base_ = 0.0;  // base_: place of a slider on the base's rail
  Vec3<double> tip_{0.0, 0.0, 0.0};
};

}  // namespace flexura
