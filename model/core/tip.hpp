// A link's tip seen from its hub: what a strip sensor measures, and what a Run shows as tip_deflection.
#pragma once
#include "model.hpp"

namespace flexura {

struct Bend {
  double deflection = 0.0;  // r_y: distance of the tip across the tangent at the hub (of a sleeved link: across the sleeve) [m]
  double slope = 0.0;       // Theta: angle of the tip's tangent to it [rad]
};

// The bend of a link (from 0) at q (n), by (1) and (2). 0 of a rigid link.
Bend bend(const Model<double> &model, int link, const double *q);

// The last link that bends, or -1.
int last_bending(const Model<double> &model);

}  // namespace flexura
