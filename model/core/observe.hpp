// What a run shows of a state: poses of the links, how they are bent, the tip, energies.
#pragma once
#include <vector>

#include "places.hpp"

namespace flexura {

// How a link's tip stands to the tangent at its hub (of a sleeved link: at the exit): distance across it, angle to it.
struct Bend {
  double deflection = 0.0, slope = 0.0;  // [m], [rad]
};
Bend bend(const Model<double> &model, Workspace<double> &work, const double *y, int link);

// The last link that bends, or -1.
int last_flexible(const Model<double> &model);

// Columns of an observation, link by link: x, y, angle of the hub's frame (of a sleeved link its proximal end); of a link that bends also the
// tip's distance across the tangent at its hub (sleeve), the tip's angle to it, and that distance at `stations` equally spaced
// abscissas of the material; then tip x, y; kinetic, strain, potential energy.
class Observer {
public:
  Observer(const Model<double> &model, int stations);
  int columns() const { return columns_; }
  void observe(const double *y, const double *v, double *row);

private:
  struct Station {
    int piece;                   // that the abscissa is on; of a sleeved link decided by d
    double abscissa;             // from the piece's hub (sleeved: of the material) [m]
    std::vector<double> weight;  // (P) of e_j: the place from the piece's hub
  };
  double across(const std::vector<Hub<double>> &hubs, const Station &station, const double *y, int first, double sine, double cosine) const;

  const Model<double> &model_;
  Workspace<double> work_;
  std::vector<std::vector<Station>> stations_;  // per link
  int columns_ = 0;
};

}  // namespace flexura
