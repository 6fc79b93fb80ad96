// The equations of motion linearised about any state (52): exact derivatives of the accelerations,
// by dual numbers.
#pragma once
#include <vector>

#include "robot/model.hpp"

namespace flexura {

// a(q, v, f) (n) and da/dq, da/dv, da/df (n, n), row by row. With x = (q, v) the linearised system
// is
//     x' = [0 1; by_position by_rate] x + [0; by_force] f.
// Rows and columns of held joints are 0: they stay at their acceleration, 0.
struct Linear {
  std::vector<double> acceleration, by_position, by_rate, by_force;
};

// The derivatives (52) about the state (q, v) under the forces `force` (n) of joints and on elastic
// unknowns; gravity, damping and viscous friction included. `held` (links) or null: joints that do
// not move.
Linear linearise(const Model<double> &model, const double *q, const double *v, const double *force,
                 const char *held);

}  // namespace flexura
