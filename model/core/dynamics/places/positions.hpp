// Positions: hubs, tips, and any point on a bent link (1), (3), (4).
#pragma once
#include "dynamics/inverse_dynamics.hpp"

namespace flexura {

template <class Real>
struct Pose {
  Real x, y, angle;
};

// Place and velocity of a hub on the way along the chain. (Its angle: PieceState::phi.)
template <class Real>
struct Hub {
  Real x = 0.0, y = 0.0, vx = 0.0, vy = 0.0;
};

// The first hub at (y, v): at the origin, or as far along the axis as it slides there.
template <class Real>
inline Hub<Real> first_hub(const Model<Real> &model, const Real *y, const Real *v) {
  Hub<Real> hub;
  const Piece<Real> &c = model.pieces.front();
  if (c.joint == HubJoint::slider) hub.x = y[c.first] + c.offset, hub.vx = v[c.first];
  return hub;
}

// Where a piece's tip, or the slider on it, is from its hub; and its velocity, from the columns
// that `outward_kinematics` has left.
template <class Real>
inline void advance_hub(const Piece<Real> &c, const PieceState<Real> &k, const Real *v,
                        const Piece<Real> *next, Hub<Real> &hub) {
  const int stride = padded(columns_of(c)), g = c.joint == HubJoint::sleeve;
  const Real *tx = k.tip, *ty = tx + stride;
  hub.x += ty[0], hub.y -= tx[0];  // a quarter turn of the way is what turning moves
  hub.vx += tx[0] * k.omega, hub.vy += ty[0] * k.omega;
  for (int i = 0; i < c.m; ++i)
    hub.vx += tx[1 + i] * v[c.own() + i], hub.vy += ty[1 + i] * v[c.own() + i];
  if (g) hub.vx += tx[c.m + 1] * v[c.first], hub.vy += ty[c.m + 1] * v[c.first];
  if (next == nullptr || next->joint != HubJoint::slider) return;
  hub.vx += k.slide.x * v[next->first], hub.vy += k.slide.y * v[next->first];
}

// Poses of the links' hubs (links + 1; the last: the tip of the last link), and the velocity of
// that tip. After `outward_kinematics`. Of a sleeved link the pose of its proximal end, which is
// inside or behind the sleeve.
template <class Real>
void hub_poses(const Model<Real> &model, const Workspace<Real> &work, const Real *y, const Real *v,
               Pose<Real> *poses, Real *tip_velocity) {
  Hub<Real> hub = first_hub(model, y, v);
  const std::size_t count = model.pieces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    if (int(i) == model.line[std::size_t(c.link)]) {
      Real back = 0.0, sine, cosine;
      if (c.joint == HubJoint::sleeve) back = y[c.first] - c.length;
      sincos(k.phi, sine, cosine);
      poses[c.link] = {hub.x + back * cosine, hub.y + back * sine, k.phi};
    }
    advance_hub(c, k, v, i + 1 < count ? &model.pieces[i + 1] : nullptr, hub);
    if (i + 1 == count) {
      Real angle = k.phi;
      for (int l = 0; l < c.m; ++l) angle += c.tip_angle[l] * y[c.own() + l];
      poses[model.links()] = {hub.x, hub.y, angle};
      tip_velocity[0] = hub.vx, tip_velocity[1] = hub.vy;
    }
  }
}

// Places x, y (3) and angles theta of a link's line at the abscissas s (count) [m] of its material,
// in the base's axes, after `outward_kinematics`. Of a sleeved link what is inside or behind the
// sleeve lies on its axis.
void line_points(const Model<double> &model, const Workspace<double> &work, const double *y,
                 int link, const double *s, int count, Pose<double> *out);

}  // namespace flexura
