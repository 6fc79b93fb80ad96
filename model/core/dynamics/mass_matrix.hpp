// The mass matrix M(q) of a chain in one sweep inward, by composite bodies (48).
#pragma once
#include "dynamics/inverse_dynamics.hpp"

namespace flexura {

// The inertia of a piece and of all beyond it, with no unknown eliminated: (48).
template <class Real, int MOST, int FLOW, class Size>
inline void composite(const Piece<Real> &c, Rows<Real, MOST, FLOW> &rows, int row, Size m,
                      Vec3<Real> *wrench, Sym3<Real> &A, Real *M, int n) {
  const int own = c.own();
  for (int i = 0; i < m; ++i) {
    wrench[own + i] = {rows.x[1 + i], rows.y[1 + i], rows.row[0][1 + i]};
    for (int l = i; l < m; ++l) M[(own + i) * n + own + l] = rows.row[1 + i][1 + l];
    if constexpr (FLOW > 0) M[row * n + own + i] = rows.row[1 + i][m + 1];
  }
  if constexpr (FLOW > 0)
    wrench[row] = {rows.x[m + 1], rows.y[m + 1], rows.row[0][m + 1]},
    M[row * n + row] = rows.row[m + 1][m + 1] + c.rotor;
  A = {rows.xx, rows.xy, rows.x[0], rows.yy, rows.y[0], rows.row[0][0]};
}

// M of (40), n x n, at the n unknowns y. `wrench`, n values, is scratch: what a unit acceleration
// of an unknown takes at the hub that the sweep has reached.
template <class Real>
void mass_matrix(const Model<Real> &model, Workspace<Real> &work, const Real *y, const Real *rest,
                 Vec3<Real> *wrench, Real *M) {
  const int n = model.n;
  outward_kinematics(model, work, y, rest);
  ArticulatedInertia<Real> beyond{};
  for (std::size_t i = model.pieces.size(); i-- > 0;) {
    const Piece<Real> &c = model.pieces[i];
    const PieceState<Real> &k = work.kept[i];
    const bool last = i + 1 == model.pieces.size(), sleeve = c.joint == HubJoint::sleeve;
    const int m = c.m, stride = padded(columns_of(c)), row = c.first, after = c.own() + m;
    for (int e = after; e < n;
         ++e) {  // what is beyond: met by this piece's unknowns, and carried to its hub
      Vec3<Real> &w = wrench[e];
      auto meets = [&](int column) {
        return k.tip[column] * w.x + k.tip[stride + column] * w.y +
               k.tip[2 * stride + column] * w.t;
      };
      for (int l = 0; l < m; ++l) M[(c.own() + l) * n + e] = meets(1 + l);
      if (sleeve) M[row * n + e] = meets(m + 1);
      w.t = meets(0);
    }
    Sym3<Real> A;
    if (sleeve) {
      SleeveRows<Real> rows;
      sleeve_rows(c, k, y, rest, last, rows);
      if (!last) add_beyond(rows, k, m, 1, stride, beyond);
      composite(c, rows, row, Free{m}, wrench, A, M, n);
    } else {
      sized<Real, false>(c.m, c.P, [&](auto fixed, auto P) {
        Rows<Real, decltype(fixed)::most, 0> rows;
        elastic_rows(c, k, last, fixed, P, rows);
        if (!last) add_beyond(rows, k, m, 0, stride, beyond);
        composite(c, rows, row, fixed, wrench, A, M, n);
      });
    }
    beyond.A = A;
    if (c.joint == HubJoint::none || sleeve) continue;
    for (int e = c.own(); e < n; ++e) M[row * n + e] = dot(k.along, wrench[e]);
    wrench[row] = A * k.along;
    M[row * n + row] = dot(k.along, wrench[row]) + c.rotor;
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) M[i * n + j] = M[j * n + i];
}

extern template void mass_matrix(const Model<double> &, Workspace<double> &, const double *,
                                 const double *, Vec3<double> *, double *);
extern template void mass_matrix(const Model<Pack<4>> &, Workspace<Pack<4>> &, const Pack<4> *,
                                 const Pack<4> *, Vec3<Pack<4>> *, Pack<4> *);

}  // namespace flexura
