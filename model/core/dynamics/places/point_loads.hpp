// Generalised forces of forces and moments that act on points of links (133) to (135).
#pragma once
#include "dynamics/places/load_place.hpp"
#include "dynamics/places/positions.hpp"

namespace flexura {

// Adds the generalised forces (133), (134) of loads at q (n) to `out` (n). `values` (count, 3): of
// each load the force's two components [N] and the moment [N m].
void add_point_loads(const Model<double> &model, Workspace<double> &work, const LoadPlace *places,
                     int count, const double *values, const double *q, double *out);

}  // namespace flexura
