// Inverse dynamics (59): the forces of a motion, in one sweep out and one back.
#pragma once
#include "dynamics/forward_dynamics.hpp"

namespace flexura {

// What `forces` takes in.
struct Terms {
  bool gravity = true, stiffness = true,
       damping =
           true;  // damping (with stiffness only): D v, viscous friction; never Coulomb friction
};

// W z of a piece's points, z (P, 2): R^T (R z) (16).
template <class Real>
inline void weigh_points(const Piece<Real> &c, const Real *zx, const Real *zy, Real *Yx, Real *Yy) {
  const int P = c.P;
  for (int j = 0; j < P; ++j) Yx[j] = Yy[j] = 0.0;
  for (int p = 0; p < P; ++p) {
    Real x = 0.0, y = 0.0;
    for (int j = p; j < P; ++j) x += c.R[p * P + j] * zx[j], y += c.R[p * P + j] * zy[j];
    for (int j = p; j < P; ++j) Yx[j] += c.R[p * P + j] * x, Yy[j] += c.R[p * P + j] * y;
  }
}

// The wrench that moves the hub of a piece of constant length at u, and the forces on its own
// unknowns (m), at accelerations a (m).
template <class Real>
inline Vec3<Real> inertial(const Piece<Real> &c, const PieceState<Real> &k, const Vec3<Real> &u,
                           const Real *a, bool last, Real *out) {
  const int m = c.m, P = c.P;
  Real zx[Free::most], zy[Free::most], Yx[Free::most], Yy[Free::most];
  Vec3<Real> wrench{c.mass * u.x, c.mass * u.y, c.hub * u.t};
  for (int j = 0; j < P; ++j) {
    Real turning = u.t;
    for (int i = 0; i < m; ++i) turning += c.B[i * padded(P) + j] * a[i];
    const Real square = k.rate[j] * k.rate[j];
    zx[j] = -k.sine[j] * turning - k.cosine[j] * square,
    zy[j] = k.cosine[j] * turning - k.sine[j] * square;
    wrench.x += c.moment[j] * zx[j], wrench.y += c.moment[j] * zy[j];
  }
  weigh_points(c, zx, zy, Yx, Yy);
  for (int i = 0; i < m; ++i) out[i] = 0.0;
  for (int j = 0; j < P; ++j) {
    const Real moment =
        k.cosine[j] * (Yy[j] + c.moment[j] * u.y) - k.sine[j] * (Yx[j] + c.moment[j] * u.x);
    wrench.t += moment;
    for (int i = 0; i < m; ++i) out[i] += c.B[i * padded(P) + j] * moment;
  }
  if (last) {
    Real turning = u.t;
    for (int i = 0; i < m; ++i) turning += c.tip_angle[i] * a[i];
    wrench.t += c.tip * turning;
    for (int i = 0; i < m; ++i) out[i] += c.tip * c.tip_angle[i] * turning;
  }
  if (c.turning)
    for (int i = 0; i <= m; ++i) {
      Real moment = c.spin[i * (m + 1)] * u.t;
      for (int l = 0; l < m; ++l) moment += c.spin[i * (m + 1) + 1 + l] * a[l];
      (i == 0 ? wrench.t : out[i - 1]) += moment;
    }
  return wrench;
}

// The same of a sleeved piece; its row of d into flow_force.
template <class Real>
Vec3<Real> inertial_sleeve(const Piece<Real> &c, const PieceState<Real> &k, const Real *y,
                           const Real *v, const Vec3<Real> &u, const Real &flow, const Real *a,
                           const Terms &terms, bool last, Real *out, Real &flow_force) {
  SleeveRows<Real> rows;
  sleeve_rows(c, k, y, v, last, rows);
  if (terms.stiffness) {
    Piece<Real> elastic = c;
    if (!terms.damping) elastic.beta = 0.0;
    add_bending(rows, elastic, Stage<Real>{y, v, 0.0, 0.0, nullptr, nullptr}, y + c.own(),
                y[c.first]);
  }
  const int m = c.m;
  auto product = [&](const auto &row, int from) {  // with the accelerations, columns `from` on
    Real sum = row[m + 2];
    if (from <= 0) sum += row[0] * u.t;
    for (int i = from > 1 ? from : 1; i <= m; ++i) sum += row[i] * a[i - 1];
    return sum + row[m + 1] * flow;
  };
  for (int i = 1; i <= m; ++i) {  // only the upper triangle is formed
    Real sum = product(rows.row[i], i) + rows.row[0][i] * u.t + rows.x[i] * u.x + rows.y[i] * u.y;
    for (int l = 1; l < i; ++l) sum += rows.row[l][i] * a[l - 1];
    out[i - 1] = sum;
  }
  Real own = rows.row[m + 1][m + 2] + rows.row[m + 1][m + 1] * flow + rows.row[0][m + 1] * u.t +
             rows.x[m + 1] * u.x + rows.y[m + 1] * u.y;
  for (int i = 1; i <= m; ++i) own += rows.row[i][m + 1] * a[i - 1];
  flow_force = own;
  return {product(rows.x, 0) + rows.xx * u.x + rows.xy * u.y,
          product(rows.y, 0) + rows.xy * u.x + rows.yy * u.y,
          product(rows.row[0], 0) + rows.x[0] * u.x + rows.y[0] * u.y};
}

// The n forces of a motion (59): M a + h(q, v), plus what `terms` names of stiffness, damping and
// (taken off) gravity. With v = 0 and no terms: M times a vector.
template <class Real>
void forces(const Model<Real> &model, Workspace<Real> &work, const Real *y, const Real *v,
            const Real *a, const Terms &terms, Real *out) {
  const std::size_t count = model.pieces.size();
  outward_kinematics(model, work, y, v);
  const Real weight = terms.gravity ? 1.0 : 0.0;
  Vec3<Real> u{-weight * model.gravity[0], -weight * model.gravity[1], 0.0};
  std::vector<Vec3<Real>> &wrench = work.wrenches;
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    const bool last = i + 1 == count, sleeve = c.joint == HubJoint::sleeve;
    Real own = 0.0;
    if (c.joint != HubJoint::none) own = a[c.first], out[c.first] = c.rotor * own;
    if (c.joint != HubJoint::none && !sleeve) u = u + own * k.along;
    Real *rows = out + c.own();
    if (sleeve) {
      Real flow_force;
      wrench[i] = inertial_sleeve(c, k, y, v, u, own, a + c.own(), terms, last, rows, flow_force);
      out[c.first] += flow_force;
    } else {
      wrench[i] = inertial(c, k, u, a + c.own(), last, rows);
      for (int l = 0; l < c.m; ++l) {
        if (terms.stiffness) rows[l] += c.K[l] * y[c.own() + l];
        if (terms.damping) rows[l] += c.D[l] * v[c.own() + l];
      }
    }
    u = next_hub(c, k, u, own, a + c.own());
  }
  Vec3<Real> beyond{0.0, 0.0, 0.0};
  for (std::size_t i = count; i-- > 0;) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    const int stride = padded(columns_of(c)), g = c.joint == HubJoint::sleeve;
    auto meets = [&](int column) {
      return k.tip[column] * beyond.x + k.tip[stride + column] * beyond.y +
             k.tip[2 * stride + column] * beyond.t;
    };
    for (int l = 0; l < c.m; ++l) out[c.own() + l] += meets(1 + l);
    if (g) out[c.first] += meets(c.m + 1);
    beyond = Vec3<Real>{wrench[i].x + beyond.x, wrench[i].y + beyond.y, wrench[i].t + meets(0)};
    if (c.joint == HubJoint::none) continue;
    if (!g) out[c.first] += dot(k.along, beyond);
    const std::size_t link = std::size_t(c.link);
    if (terms.stiffness) out[c.first] += model.spring[link] * (y[c.first] - model.rest[link]);
    if (terms.damping) out[c.first] += model.viscous[link] * v[c.first];
  }
  if (terms.damping && model.mass_damped) add_mass_damping(model, y, v, out);
}

// The sweeps are compiled once a kind of number: sweeps_one.cpp, sweeps_four.cpp, sweeps_dual.cpp.
#define FLEXURA_SWEEPS(EXTERN, Real)                                                              \
  EXTERN template void outward_kinematics(const Model<Real> &, Workspace<Real> &, const Real *,   \
                                          const Real *);                                          \
  EXTERN template void accelerate(const Model<Real> &, Workspace<Real> &, const Real *,           \
                                  const Real *, const Stage<Real> &, const Real *,                \
                                  const Held<Real> &, Real *);                                    \
  EXTERN template void add_mass_damping(const Model<Real> &, const Real *, const Real *, Real *); \
  EXTERN template void forces(const Model<Real> &, Workspace<Real> &, const Real *, const Real *, \
                              const Real *, const Terms &, Real *);
FLEXURA_SWEEPS(extern, double)
FLEXURA_SWEEPS(extern, Pack<4>)
FLEXURA_SWEEPS(extern, Dual<4>)

}  // namespace flexura
