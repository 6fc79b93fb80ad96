// Forward dynamics of a chain (44) to (47) in time proportional to its length: three sweeps over
// its pieces.
//
// 1. Outward (kinematics.hpp): angles, rates and places of the joints.
// 2. Inward (condensation.hpp, sleeve.hpp): the wrench A u + b that moves a hub. Of a piece's rows
//    its own unknowns and its joint are eliminated.
// 3. Outward: accelerations of joints and elastic unknowns.
#pragma once
#include "dynamics/piece/mass_proportional_damping.hpp"

namespace flexura {

// Joints that are held to an acceleration, per link: the force that this takes comes out as a
// reaction.
template <class Real>
struct Held {
  const char *held;   // (links) or null: none
  const Real *given;  // (links) accelerations
  Real
      *reaction;  // (links) drive forces of held joints; friction that is not in `damping` left out
};

// The joint of a piece (47): its motion is along s (for a sleeve the flow), coupled with the hub's
// acceleration by `pull`. What is left is the articulated inertia of what is beyond.
template <class Real>
inline void eliminate_joint(const Model<Real> &model, const Piece<Real> &c, PieceState<Real> &k,
                            const Stage<Real> &stage, const Real &force, const Held<Real> &hold,
                            const Real *flow, ArticulatedInertia<Real> &beyond) {
  const std::size_t i = std::size_t(c.link);
  const Real stiffness = stage.stiffness ? stage.stiffness[i] : Real(0.0);
  const Real spring = model.spring[i], viscous = model.viscous[i];
  const Real damping = stage.damping ? stage.damping[i] + viscous : viscous;
  Real own = c.rotor, bias = 0.0;
  if (c.joint == HubJoint::sleeve) {
    k.pull = {flow[0], flow[1], flow[2]};
    own += flow[3], bias = flow[4];
  } else {
    k.pull = beyond.A * k.along;
    own += dot(k.along, k.pull), bias = dot(k.along, beyond.b);
  }
  const Real passive = stiffness * stage.y[c.first] + damping * stage.v[c.first] +
                       spring * (stage.y[c.first] - model.rest[i]);  // (108)
  own += stage.gq * (stiffness + spring) + stage.gv * damping;
  if (hold.held && hold.held[i]) {  // its acceleration is known
    k.inverse = own, k.rest = -(bias + passive);
    beyond.b = beyond.b + hold.given[i] * k.pull;
    return;
  }
  k.inverse = 1.0 / own;
  k.rest = force - passive - bias;
  subtract(beyond.A, k.pull, k.inverse);
  beyond.b = beyond.b + (k.rest * k.inverse) * k.pull;
}

// Accelerations of a piece's own unknowns from its hub's u and its joint's flow.
template <class Real>
inline void own_accelerations(const Piece<Real> &c, const PieceState<Real> &k, const Vec3<Real> &u,
                              const Real &flow, Real *a) {
  const int m = c.m, g = c.joint == HubJoint::sleeve;
  for (int i = m - 1; i >= 0; --i) {
    const Real *tail = k.tail + 8 * i;
    Real sum = tail[0] * u.x + tail[1] * u.y + tail[2] * u.t + tail[3 + g];
    if (g) sum += tail[3] * flow;
    Real own = -k.inverses[i] * sum;
    for (int j = i + 1; j < m; ++j) own -= k.L[j * m + i] * a[j];
    a[i] = own;
  }
}

// The acceleration of the place where the next piece sits (44), from the columns of kinematics.hpp.
template <class Real>
inline Vec3<Real> next_hub(const Piece<Real> &c, const PieceState<Real> &k, const Vec3<Real> &u,
                           const Real &flow, const Real *a) {
  const int m = c.m, g = c.joint == HubJoint::sleeve, stride = padded(columns_of(c)),
            rest = m + 1 + g;
  const Real *tx = k.tip, *ty = tx + stride, *tt = ty + stride;
  Vec3<Real> t{u.x + tx[0] * u.t + tx[rest], u.y + ty[0] * u.t + ty[rest], u.t + tt[rest]};
  for (int i = 0; i < m; ++i)
    t.x += tx[1 + i] * a[i], t.y += ty[1 + i] * a[i], t.t += tt[1 + i] * a[i];
  if (g) t.x += tx[m + 1] * flow, t.y += ty[m + 1] * flow, t.t += tt[m + 1] * flow;
  return t;
}

// Accelerations a (n) of M a + h(q, v) + K y + D v = force at the state (y, v) (n), the linear
// terms as `stage` says; `force` (n): of the joints and on the elastic unknowns.
template <class Real>
void accelerate(const Model<Real> &model, Workspace<Real> &work, const Real *y, const Real *v,
                const Stage<Real> &stage, const Real *force, const Held<Real> &hold, Real *a) {
  const std::size_t count = model.pieces.size();
  outward_kinematics(model, work, y, v);
  if (model.mass_damped) {
    Real *less = work.spare.data();
    for (int k = 0; k < model.n; ++k) less[k] = 0.0;
    add_mass_damping(model, y, v, less);
    for (int k = 0; k < model.n; ++k) less[k] = force[k] - less[k];
    force = less;
  }
  ArticulatedInertia<Real> beyond;
  for (std::size_t i = count; i-- > 0;) {
    const Piece<Real> &c = model.pieces[i];
    PieceState<Real> &k = work.kept[i];
    const bool last = i + 1 == count;
    Real flow[5];
    if (c.joint == HubJoint::sleeve)
      condense_sleeve(c, k, y, v, stage, force + c.own(), last, beyond, flow);
    else
      sized<Real>(c.m, c.P, [&](auto m, auto P) {
        condense_elastic(c, k, stage, force + c.own(), last, m, P, beyond);
      });
    if (c.joint != HubJoint::none)
      eliminate_joint(model, c, k, stage, force[c.first], hold, flow, beyond);
  }
  Vec3<Real> u{-model.gravity[0], -model.gravity[1], 0.0};
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    Real own = 0.0;
    if (c.joint != HubJoint::none) {
      const std::size_t link = std::size_t(c.link);
      const Real met = dot(k.pull, u);
      if (hold.held && hold.held[link]) {
        own = hold.given[link];
        hold.reaction[link] = k.inverse * own + met - k.rest;
      } else {
        own = k.inverse * (k.rest - met);
      }
      a[c.first] = own;
      if (c.joint != HubJoint::sleeve) u = u + own * k.along;
    }
    own_accelerations(c, k, u, own, a + c.own());
    u = next_hub(c, k, u, own, a + c.own());
  }
}

// Plain forward dynamics with nothing held and no gains.
template <class Real>
void accelerate(const Model<Real> &model, Workspace<Real> &work, const Real *y, const Real *v,
                const Real *force, Real *a) {
  accelerate(model, work, y, v, Stage<Real>{y, v, 0.0, 0.0, nullptr, nullptr}, force,
             Held<Real>{nullptr, nullptr, nullptr}, a);
}

}  // namespace flexura
