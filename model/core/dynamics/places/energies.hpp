// Kinetic energy (20), strain energy (9), gravity's potential (23), and the power that damping
// takes (28).
#pragma once
#include "dynamics/friction.hpp"
#include "dynamics/places/positions.hpp"

namespace flexura {

template <class Real>
struct Energies {
  Real kinetic = 0.0, strain = 0.0, potential = 0.0;
};

// First moment of a piece's mass about its hub, in the base's axes.
template <class Real>
void first_moment(const Piece<Real> &c, const PieceState<Real> &k, const Real *y, Real &x,
                  Real &up) {
  x = up = 0.0;
  if (c.joint != HubJoint::sleeve) {
    for (int j = 0; j < c.P; ++j) x += c.moment[j] * k.cosine[j], up += c.moment[j] * k.sine[j];
    return;
  }
  const Real d = y[c.first], first = rod_in_sleeve(c, Real(c.length - d)).first;
  Real sine, cosine;
  sincos(k.phi, sine, cosine);
  x = first * cosine, up = first * sine;
  for (int p = 0; p < c.P; ++p) {
    const Real mu = free_length_material(c, d, p).mass * d * c.weight[p];
    for (int j = 0; j < c.P; ++j) {
      const Real lever = d * (mu * c.C[p * c.P + j] + (p == 0 ? c.payload * c.w[j] : Real(0.0)));
      x += lever * k.cosine[j], up += lever * k.sine[j];
    }
  }
}

// Strain energy of a sleeved piece: 1/2 q K(d) q (35).
template <class Real>
Real sleeve_strain(const Piece<Real> &c, const Real *y) {
  Real bent[Free::most], out = 0.0;
  bending(c, y + c.own(), bent);
  const Real d = y[c.first];
  for (int p = 0; p < c.P; ++p)
    out += 0.5 * free_length_material(c, d, p).stiffness * c.weight[p] * bent[p] * bent[p] / d;
  return out;
}

// Energy of the spring beside a joint's drive (108).
template <class Real>
Real spring_energy(const Model<Real> &model, const Piece<Real> &c, const Real *y) {
  const std::size_t link = std::size_t(c.link);
  const Real wound = y[c.first] - model.rest[link];
  return 0.5 * model.spring[link] * wound * wound;
}

// Twice the kinetic energy of a sleeved piece (33), (34), without its rotor: a quadratic form in
// the rates of its hub, its own unknowns and d.
template <class Real>
Real sleeve_inertia(const Piece<Real> &c, const PieceState<Real> &k, const Real &vx, const Real &vy,
                    bool last, const Real *y, const Real *v) {
  const int m = c.m;
  SleeveRows<Real> rows;
  sleeve_rows(c, k, y, v, last, rows);
  Real rate[Free::most + 2], out = rows.xx * vx * vx + 2.0 * rows.xy * vx * vy + rows.yy * vy * vy;
  rate[0] = k.omega, rate[m + 1] = v[c.first];
  for (int i = 0; i < m; ++i) rate[1 + i] = v[c.own() + i];
  for (int a = 0; a <= m + 1; ++a) {
    Real across = 2.0 * (rows.x[a] * vx + rows.y[a] * vy) +
                  rows.row[a][a] * rate[a];  // only the upper triangle is formed
    for (int b = a + 1; b <= m + 1; ++b) across += 2.0 * rows.row[a][b] * rate[b];
    out += rate[a] * across;
  }
  return out;
}

// Kinetic energy (20), (16) of a piece whose hub moves at (vx, vy), with its rotor (21); of the
// last piece also the payload's rotary inertia (22). A payload off the tip is a piece of its own
// (111).
template <class Real>
Real kinetic_energy(const Piece<Real> &c, const PieceState<Real> &k, const Real &vx, const Real &vy,
                    bool last, const Real *y, const Real *v) {
  Real out = 0.0;
  if (c.joint != HubJoint::none) out += c.rotor * v[c.first] * v[c.first];
  if (c.joint == HubJoint::sleeve) return 0.5 * (out + sleeve_inertia(c, k, vx, vy, last, y, v));
  Real zx[Free::most], zy[Free::most], momentum_x = 0.0, momentum_y = 0.0;  // i e_j Omega_j
  for (int j = 0; j < c.P; ++j) {
    zx[j] = -k.sine[j] * k.rate[j], zy[j] = k.cosine[j] * k.rate[j];
    momentum_x += c.moment[j] * zx[j], momentum_y += c.moment[j] * zy[j];
  }
  for (int p = 0; p < c.P; ++p) {
    Real x = 0.0, y_ = 0.0;
    for (int j = p; j < c.P; ++j) x += c.R[p * c.P + j] * zx[j], y_ += c.R[p * c.P + j] * zy[j];
    out += x * x + y_ * y_;
  }
  out += c.mass * (vx * vx + vy * vy) + c.hub * k.omega * k.omega +
         2.0 * (vx * momentum_x + vy * momentum_y);
  if (c.turning)
    for (int a = 0; a <= c.m; ++a) {
      Real moment = c.spin[a * (c.m + 1)] * k.omega;
      for (int i = 0; i < c.m; ++i) moment += c.spin[a * (c.m + 1) + 1 + i] * v[c.own() + i];
      out += moment * (a == 0 ? k.omega : v[c.own() + a - 1]);
    }
  if (last) {  // the payload's rotary inertia, 1/2 I_tip Omega_L^2 (22)
    Real turning = k.omega;
    for (int i = 0; i < c.m; ++i) turning += c.tip_angle[i] * v[c.own() + i];
    out += c.tip * turning * turning;
  }
  return 0.5 * out;
}

// Energies at (y, v), n values each: kinetic (20); strain (9); potential of gravity, 0 with all
// mass at the origin.
template <class Real>
Energies<Real> energies(const Model<Real> &model, Workspace<Real> &work, const Real *y,
                        const Real *v) {
  Energies<Real> out;
  outward_kinematics(model, work, y, v);
  Hub<Real> hub = first_hub(model, y, v);
  const std::size_t count = model.pieces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    Real x, up;
    first_moment(c, k, y, x, up);
    out.potential -=
        model.gravity[0] * (c.mass * hub.x + x) + model.gravity[1] * (c.mass * hub.y + up);
    out.kinetic += kinetic_energy(c, k, hub.vx, hub.vy, i + 1 == count, y, v);
    advance_hub(c, k, v, i + 1 < count ? &model.pieces[i + 1] : nullptr, hub);
    if (c.joint != HubJoint::none) out.strain += spring_energy(model, c, y);
    if (c.joint == HubJoint::sleeve)
      out.strain += sleeve_strain(c, y);
    else
      for (int l = 0; l < c.m; ++l) out.strain += 0.5 * c.K[l] * y[c.own() + l] * y[c.own() + l];
  }
  return out;
}

// Power [W] that damping and friction take (28) at (y, v), n values each.
template <class Real>
Real loss(const Model<Real> &model, const Real *y, const Real *v) {
  Real out = 0.0;
  for (const Piece<Real> &c : model.pieces) {
    if (c.joint != HubJoint::none) {
      const std::size_t link = std::size_t(c.link);
      const Real speed = v[c.first];
      out += model.viscous[link] * speed * speed +
             speed * coulomb_friction(model.coulomb[link], speed);
    }
    if (c.joint == HubJoint::sleeve) {
      Real moving[Free::most];
      bending(c, v + c.own(), moving);
      const Real d = y[c.first];
      for (int p = 0; p < c.P; ++p)
        out += c.beta * free_length_material(c, d, p).stiffness * c.weight[p] * moving[p] *
               moving[p] / d;
    } else {
      for (int l = 0; l < c.m; ++l) out += c.D[l] * v[c.own() + l] * v[c.own() + l];
    }
  }
  if (model.mass_damped) {
    std::vector<Real> force(std::size_t(model.n), Real(0.0));
    add_mass_damping(model, y, v, force.data());
    for (int i = 0; i < model.n; ++i) out += force[std::size_t(i)] * v[i];
  }
  return out;
}

}  // namespace flexura
