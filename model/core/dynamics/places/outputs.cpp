#include "dynamics/places/outputs.hpp"

#include <algorithm>

#include "numbers/pack_lane.hpp"
#include "numbers/quadrature.hpp"

namespace flexura {

int last_flexible(const Model<double> &model) {
  int link = model.links() - 1;
  while (link >= 0 && !model.bends(link)) --link;
  return link;
}

template <class Real>
BendOf<Real> bend(const Model<Real> &model, Workspace<Real> &work, const Real *y, int link) {
  Real phi = 0.0, up = 0.0;  // in the hub's own axes
  for (int i = model.line[std::size_t(link)]; i < model.begin[std::size_t(link) + 1]; ++i) {
    const Piece<Real> &c = model.pieces[std::size_t(i)];
    PieceState<Real> &k = work.kept[std::size_t(i)];
    const Real *q = y + c.own();
    const Real scale = c.joint == HubJoint::sleeve ? y[c.first] : Real(1.0);
    k.phi = phi, k.omega = 0.0;
    sized<Real>(c.m, c.P, [&](auto m, auto P) { tangent_angles(c, k, q, q, m, P); });
    for (int j = 0; j < c.P; ++j) up += scale * c.w[j] * k.sine[j];
    for (int l = 0; l < c.m; ++l) phi += c.tip_angle[l] * q[l];
  }
  return {up, phi};
}

template <class Real>
Observer<Real>::Observer(const Model<Real> &model, int stations)
    : model_(model),
      work_(model),
      stations_(std::size_t(model.links())),
      poses_(std::size_t(model.links()) + 1) {
  for (int link = 0; link < model.links(); ++link) {
    part_.insert(part_.end(), 3, POSES);
    if (!model.bends(link)) continue;
    part_.insert(part_.end(), 2, BENDS), part_.insert(part_.end(), std::size_t(stations), STATIONS);
    const int first = model.line[std::size_t(link)],
              count = model.begin[std::size_t(link) + 1] - first;
    std::vector<double> ends{0.0};  // of the pieces, by the length of the first
    for (int i = 0; i < count; ++i) {
      const Piece<Real> &c = model.pieces[std::size_t(first + i)];
      const double unit = lane(model.pieces[std::size_t(first)].length, 0);
      ends.push_back(c.turning ? ends.back() + lane(c.length, 0) / unit : i + 1);  // else equal
    }
    const bool sleeved = model.kind[std::size_t(link)] == JointKind::sleeve;
    for (int k = 0; k < stations; ++k) {
      const double along = k * ends.back() / (stations - 1);
      int piece = 0;
      while (piece + 1 < count && along >= ends[std::size_t(piece) + 1]) ++piece;
      const int P = model.pieces[std::size_t(first + piece)].P;
      const double begin = ends[std::size_t(piece)];
      Station station{first + piece, (along - begin) / (ends[std::size_t(piece) + 1] - begin),
                      std::vector<double>(std::size_t(P))};
      if (!sleeved)
        line_weights(line_rule(P), 2.0 * station.share - 1.0, 0.5, station.weight.data());
      stations_[std::size_t(link)].push_back(std::move(station));
    }
  }
  part_.insert(part_.end(), 2, POSES), part_.insert(part_.end(), 3, ENERGIES);
}

// How far the stations of a link lie from the tangent at its hub; after `outward_kinematics`.
template <class Real>
void Observer<Real>::place_stations(const Real *y, int link, Real *out) {
  const int first = model_.line[std::size_t(link)];
  Real sine, cosine,
      x = 0.0, up = 0.0;  // of the hub's axes; from the hub to the piece's, in the base's axes
  sincos(work_.kept[std::size_t(first)].phi, sine, cosine);
  int i = first;
  auto go = [&](const Piece<Real> &c, const PieceState<Real> &k, const auto &weight,
                const Real &scale, Real &along, Real &across) {
    for (int j = 0; j < c.P; ++j)
      along += scale * weight[j] * k.cosine[j], across += scale * weight[j] * k.sine[j];
  };
  for (const Station &station : stations_[std::size_t(link)]) {
    for (; i < station.piece; ++i)
      go(model_.pieces[std::size_t(i)], work_.kept[std::size_t(i)], model_.pieces[std::size_t(i)].w,
         Real(1.0), x, up);
    const Piece<Real> &c = model_.pieces[std::size_t(i)];
    const PieceState<Real> &k = work_.kept[std::size_t(i)];
    Real along = x, across = up;
    if (c.joint == HubJoint::sleeve) {
      const Real d = y[c.first], free = (c.length * (station.share - 1.0) + d) / d,
                 xi = larger(free, Real(0.0));  // 0: in or behind the sleeve
      Real w[2 * MOST_POINTS], by[2 * MOST_POINTS], twice[2 * MOST_POINTS];
      line_point_shapes(c, Real(2.0 * xi - 1.0), w, by, twice);
      go(c, k, w, d, along, across);
      across = choose_less(Real(0.0), free, across * cosine - along * sine, Real(0.0));
    } else {
      go(c, k, station.weight, c.length, along, across);
      across = across * cosine - along * sine;
    }
    *out++ = across;
  }
}

template <class Real>
void Observer<Real>::observe(const Real *y, const Real *v, Real *row, int parts) {
  Energies<Real> energy;
  Real rate[2];
  if (parts & ENERGIES) energy = energies(model_, work_, y, v);
  if (parts & (POSES | STATIONS))
    outward_kinematics(model_, work_, y, v), hub_poses(model_, work_, y, v, poses_.data(), rate);
  Real *out = row;
  for (int link = 0; link < model_.links();
       ++link) {  // stations first: a bend is found in other axes
    const auto &stations = stations_[std::size_t(link)];
    const Pose<Real> &pose = poses_[std::size_t(link)];
    if (parts & POSES) out[0] = pose.x, out[1] = pose.y, out[2] = pose.angle;
    out += 3;
    if (!model_.bends(link)) continue;
    if (parts & STATIONS) place_stations(y, link, out + 2);
    if (parts & BENDS) {
      const BendOf<Real> tip = bend(model_, work_, y, link);
      out[0] = tip.deflection, out[1] = tip.slope;
    }
    out += 2 + stations.size();
  }
  const Pose<Real> &tip = poses_[std::size_t(model_.links())];
  if (parts & POSES) out[0] = tip.x, out[1] = tip.y;
  if (parts & ENERGIES) out[2] = energy.kinetic, out[3] = energy.strain, out[4] = energy.potential;
}

template Bend bend(const Model<double> &, Workspace<double> &, const double *, int);
template BendOf<Pack<4>> bend(const Model<Pack<4>> &, Workspace<Pack<4>> &, const Pack<4> *, int);
template class Observer<double>;
template class Observer<Pack<4>>;

}  // namespace flexura
