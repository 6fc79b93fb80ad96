#include "dynamics/mass_matrix.hpp"

namespace flexura {

template void mass_matrix(const Model<double> &, Workspace<double> &, const double *,
                          const double *, Vec3<double> *, double *);
template void mass_matrix(const Model<Pack<4>> &, Workspace<Pack<4>> &, const Pack<4> *,
                          const Pack<4> *, Vec3<Pack<4>> *, Pack<4> *);

}  // namespace flexura
