// What a run shows of a state: poses of the links, how they are bent, the tip, energies. Of one
// robot, or of four at once with the same digits.
#pragma once
#include <vector>

#include "dynamics/places/energies.hpp"

namespace flexura {

// How a link's tip stands to the tangent at its hub (of a sleeved link: at the exit): distance
// across it, angle to it (6).
template <class Real>
struct BendOf {
  Real deflection = 0.0, slope = 0.0;  // [m], [rad]
};
using Bend = BendOf<double>;
template <class Real>
BendOf<Real> bend(const Model<Real> &model, Workspace<Real> &work, const Real *y, int link);

// The last link that bends, or -1.
int last_flexible(const Model<double> &model);

// Columns of an observation, link by link: x, y, angle of the hub's frame (of a sleeved link its
// proximal end); of a link that bends also the tip's distance across the tangent at its hub
// (sleeve), the tip's angle to it, and that distance at `stations` equally spaced abscissas of the
// material; then tip x, y; kinetic, strain, potential energy.
template <class Real>
class Observer {
 public:
  enum Part { BENDS = 1, POSES = 2, STATIONS = 4, ENERGIES = 8, ALL = 15 };

  Observer(const Model<Real> &model, int stations);
  int columns() const { return int(part_.size()); }
  Part part_of(int column) const { return part_[std::size_t(column)]; }
  // Columns of parts that are not asked for are left as they are.
  void observe(const Real *y, const Real *v, Real *row, int parts = ALL);

 private:
  struct Station {
    int piece;     // that the abscissa is on; of a sleeved link decided by d
    double share;  // of the piece's (sleeved: the material's) length
    std::vector<double>
        weight;  // (P) of e_j: the place from the piece's hub, per length of the piece
  };
  void place_stations(const Real *y, int link, Real *out);

  const Model<Real> &model_;
  Workspace<Real> work_;
  std::vector<std::vector<Station>> stations_;  // per link
  std::vector<Part> part_;                      // per column
  std::vector<Pose<Real>> poses_;
};

}  // namespace flexura
