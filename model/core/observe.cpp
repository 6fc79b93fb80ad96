#include "observe.hpp"

#include "quadrature.hpp"

namespace flexura {
namespace {

// Weights (P) of the place at the fraction x of a line of length 1 with P Gauss points (2).
std::vector<double> weights_at(int P, double x) {
  std::vector<double> out(static_cast<std::size_t>(P));
  line_weights(line_rule(P), 2.0 * x - 1.0, 0.5, out.data());
  return out;
}

bool bends(const Model<double> &model, int link) { return model.elastic[std::size_t(link)] > 0; }

}  // namespace

int last_flexible(const Model<double> &model) {
  int link = model.links() - 1;
  while (link >= 0 && !bends(model, link)) --link;
  return link;
}

Bend bend(const Model<double> &model, Workspace<double> &work, const double *y, int link) {
  const int end = model.begin[std::size_t(link) + 1];
  const int first = model.kind[std::size_t(link)] == JointKind::sleeve ? end - 1 : model.begin[std::size_t(link)];
  Bend out;
  double phi = 0.0, up = 0.0;  // in the hub's own axes
  for (int i = first; i < end; ++i) {
    const Piece<double> &c = model.pieces[std::size_t(i)];
    Kept<double> &k = work.kept[std::size_t(i)];
    const double *q = y + c.own(), scale = c.joint == At::sleeve ? y[c.first] : 1.0;
    k.phi = phi, k.omega = 0.0;
    turn(c, k, q, q, Free{c.m}, Free{c.P});
    for (int j = 0; j < c.P; ++j) up += scale * c.w[j] * k.sine[j];
    for (int l = 0; l < c.m; ++l) phi += c.tip_angle[l] * q[l];
  }
  out.deflection = up, out.slope = phi;
  return out;
}

Observer::Observer(const Model<double> &model, int stations) : model_(model), work_(model), stations_(std::size_t(model.links())) {
  for (int link = 0; link < model.links(); ++link) {
    columns_ += 3;
    if (!bends(model, link)) continue;
    columns_ += 2 + stations;
    const int begin = model.begin[std::size_t(link)], end = model.begin[std::size_t(link) + 1];
    double length = 0.0;
    for (int i = begin; i < end; ++i) length += model.pieces[std::size_t(i)].length;
    for (int k = 0; k < stations; ++k) {
      double s = length * k / (stations - 1);
      int i = begin;
      while (i + 1 < end && s > model.pieces[std::size_t(i)].length) s -= model.pieces[std::size_t(i)].length, ++i;
      const Piece<double> &c = model.pieces[std::size_t(i)];
      if (k + 1 == stations) i = end - 1, s = model.pieces[std::size_t(i)].length;
      Station station{i, s, {}};
      const Piece<double> &on = model.pieces[std::size_t(i)];
      if (c.joint != At::sleeve && on.length > 0.0) {
        station.weight = weights_at(on.P, s / on.length);
        for (double &w : station.weight) w *= on.length;
      }
      stations_[std::size_t(link)].push_back(station);
    }
  }
  columns_ += 5;
}

// How far a station lies from the hub `first` across its tangent.
double Observer::across(const std::vector<Hub<double>> &hubs, const Station &station, const double *y, int first, double sine,
                        double cosine) const {
  const std::size_t i = std::size_t(station.piece);
  const Piece<double> &c = model_.pieces[i];
  const Kept<double> &k = work_.kept[i];
  double x = hubs[i].x - hubs[std::size_t(first)].x, up = hubs[i].y - hubs[std::size_t(first)].y;
  if (c.joint == At::sleeve) {
    const double d = y[c.first], xi = (station.abscissa - c.length + d) / d;
    if (xi <= 0.0) return 0.0;
    double at[2 * Free::most], by[2 * Free::most], twice[2 * Free::most];
    rail_values(c, 2.0 * xi - 1.0, at, by, twice);
    for (int j = 0; j < c.P; ++j) x += d * at[j] * k.cosine[j], up += d * at[j] * k.sine[j];
  } else {
    for (int j = 0; j < c.P; ++j) x += station.weight[std::size_t(j)] * k.cosine[j], up += station.weight[std::size_t(j)] * k.sine[j];
  }
  return up * cosine - x * sine;
}

void Observer::observe(const double *y, const double *v, double *row) {
  const Energies<double> energy = energies(model_, work_, y, v);  // leaves the sweep without rates
  outward_kinematics(model_, work_, y, v);
  std::vector<Pose<double>> poses(std::size_t(model_.links()) + 1);
  double rate[2];
  places(model_, work_, y, v, poses.data(), rate);
  std::vector<Hub<double>> hubs;
  Hub<double> hub;
  for (std::size_t i = 0; i < model_.pieces.size(); ++i) {
    const Piece<double> &c = model_.pieces[i];
    if (i == 0 && c.joint == At::slider) hub.x += y[c.first] + c.offset;
    hubs.push_back(hub);
    go_on(c, work_.kept[i], y, v, i + 1 < model_.pieces.size() ? &model_.pieces[i + 1] : nullptr, hub);
  }
  double *out = row;
  for (int link = 0; link < model_.links(); ++link) {
    const Pose<double> &pose = poses[std::size_t(link)];
    *out++ = pose.x, *out++ = pose.y, *out++ = pose.angle;
    if (!bends(model_, link)) continue;
    const auto &stations = stations_[std::size_t(link)];
    const int end = model_.begin[std::size_t(link) + 1], first = model_.kind[std::size_t(link)] == JointKind::sleeve ? end - 1 : model_.begin[std::size_t(link)];
    double sine, cosine, slope = 0.0;
    sincos(pose.angle, sine, cosine);
    for (int i = first; i < end; ++i) {
      const Piece<double> &c = model_.pieces[std::size_t(i)];
      for (int l = 0; l < c.m; ++l) slope += c.tip_angle[l] * y[c.own() + l];
    }
    *out++ = across(hubs, stations.back(), y, first, sine, cosine), *out++ = slope;
    for (const Station &station : stations) *out++ = across(hubs, station, y, first, sine, cosine);
  }
  const Pose<double> &tip = poses[std::size_t(model_.links())];
  *out++ = tip.x, *out++ = tip.y;
  *out++ = energy.kinetic, *out++ = energy.strain, *out++ = energy.potential;
}

}  // namespace flexura
