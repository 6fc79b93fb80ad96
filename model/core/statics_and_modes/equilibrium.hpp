// Static equilibrium: the shape that a robot takes under gravity and a dead load at its tip, with
// its joints held, or free to turn: (50).
//
// The energy V of potential_energy.hpp is stationary (50): Newton's method, each step as long as V
// falls. From the straight robot without load the load grows in steps, as large as they succeed,
// and along the way V must stay at a minimum: every pivot of every tangent positive. Where a step
// ends otherwise it is halved. If the tangent is singular wherever the load is increased, however
// little, the shape is lost there: a column buckles, an arch snaps. That is an answer, not a
// failure; `share` is the part of the load that is borne.
#pragma once
#include "statics_and_modes/potential_energy.hpp"

namespace flexura {

enum class Balance {
  stable,    // found; every small motion takes energy
  unstable,  // more than `share` of gravity and load is not borne: the shape buckles or snaps; q is
             // the last stable one
  missing  // no equilibrium was found beyond `share`, for whatever other reason; q is the last one
};

struct Equilibrium {
  Balance balance = Balance::missing;
  double share = 0.0;         // of gravity and load that q bears: 1 if stable
  int sweeps = 0;             // Newton steps in all
  double residual = 0.0;      // what the last step would change any angle by [rad]
  Vec3<double> tip{0, 0, 0};  // place [m] and angle [rad] of the last tip
};

// The equilibrium (50) with the joints at their positions in q (n), its elastic unknowns put into
// q. They are 0 on entry, or a first guess for the full load (to choose a branch). `free` (links)
// or null: revolute joints that turn until nothing turns them, from their position in q; sliders
// and sleeves are held. A free joint that nothing holds makes the answer unstable. Gravity is the
// model's.
Equilibrium equilibrium(const Model<double> &model, double *q, const TipLoad &load = {},
                        const char *free = nullptr);

}  // namespace flexura
