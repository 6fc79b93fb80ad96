// Condensation of one piece to its hub, the inward sweep (45), (46), (49). With u the acceleration
// of its hub (place and angle, gravity taken off) and the wrench A t + b at its tip, t the tip's
// acceleration, the piece's rows are formed by columns, its own unknowns are eliminated, and what
// is left is the wrench A u + b that moves its hub.
#pragma once
#include "dynamics/piece/kinematics.hpp"

namespace flexura {

// Makes an evaluation an implicit stage: stiffness and damping act at y + gq a and v + gv a, a the
// accelerations that come out, all else at the state of the evaluation. With gq = gv = 0 and the
// state's own y and v: plain forward dynamics. `stiffness` and `damping` (links): linear gains of
// the joints, viscous friction not included.
template <class Real>
struct Stage {
  const Real *y, *v;
  Real gq, gv;
  const Real *stiffness, *damping;
};

// Rows of a piece by columns (see kinematics.hpp). Rows 0: turning, 1 ... m: its own, m + 1: the
// flow of a sleeve; x, y: the hub's place.
template <class Real, int M, int G>
struct Rows {
  using Columns = Row<Real, M + 2 + G>;
  Columns row[M + 1 + G], x, y;
  Real xx, xy, yy;
};

// Wrench on the chain beyond, at acceleration t of its place: A t + b.
template <class Real>
struct ArticulatedInertia {
  Sym3<Real> A;
  Vec3<Real> b;
};

// rows += J^T A J and J^T b, J the columns of the tip's place.
template <class Real, class R>
inline void add_beyond(R &rows, const PieceState<Real> &k, int m, int flow, int stride,
                       const ArticulatedInertia<Real> &beyond) {
  using Columns = typename R::Columns;
  const int columns = m + 2 + flow, rest = columns - 1;
  const Sym3<Real> &A = beyond.A;
  Columns tx, ty, tt, fx{}, fy{}, ft{};
  load(tx, k.tip, columns), load(ty, k.tip + stride, columns),
      load(tt, k.tip + 2 * stride, columns);
  times(fx, A.xx, tx, columns), add(fx, A.xy, ty, columns), add(fx, A.xt, tt, columns);
  times(fy, A.xy, tx, columns), add(fy, A.yy, ty, columns), add(fy, A.yt, tt, columns);
  times(ft, A.xt, tx, columns), add(ft, A.yt, ty, columns), add(ft, A.tt, tt, columns);
  fx.set(rest, fx[rest] + beyond.b.x), fy.set(rest, fy[rest] + beyond.b.y),
      ft.set(rest, ft[rest] + beyond.b.t);
  add(rows.x, Real(1.0), fx, columns), add(rows.y, Real(1.0), fy, columns);
  for (int a = 0; a <= m + flow; ++a)
    add(rows.row[a], tx[a], fx, columns, a), add(rows.row[a], ty[a], fy, columns, a),
        add(rows.row[a], tt[a], ft, columns, a);
  rows.xx += A.xx, rows.xy += A.xy, rows.yy += A.yy;
}

// Condensation (46): eliminates the piece's own rows, H = L D L^T, and leaves the wrench on the hub
// in `beyond`; `flow`: (x, y, angle, flow, rest) of a sleeve's row of d. Every pivot is positive:
// the rows are those of a kinetic energy, a sum of squares (16), in a sleeve (33).
template <class Real, int M, int G>
inline void eliminate(Rows<Real, M, G> &rows, PieceState<Real> &k, int m,
                      ArticulatedInertia<Real> &beyond, Real *flow) {
  constexpr int g = G, wide = 4 + G;  // what a row couples with: x, y, angle, (flow,) rest
  const int rest = m + 1 + g;
  Sym3<Real> I{rows.xx, rows.xy, rows.x[0], rows.yy, rows.y[0], rows.row[0][0]};
  Vec3<Real> p{rows.x[rest], rows.y[rest], rows.row[0][rest]};
  Row<Real, 4 + 4 * G> tail[M + 1] = {};
  for (int j = 0; j < m; ++j) {
    fill(tail[j], Real(0.0), wide);
    tail[j].set(0, rows.x[1 + j]), tail[j].set(1, rows.y[1 + j]),
        tail[j].set(2, rows.row[0][1 + j]);
    if (g) tail[j].set(3, rows.row[1 + j][m + 1]);
    tail[j].set(wide - 1, rows.row[1 + j][rest]);
  }
  if (g) {
    flow[0] = rows.x[m + 1], flow[1] = rows.y[m + 1], flow[2] = rows.row[0][m + 1];
    flow[3] = rows.row[m + 1][m + 1], flow[4] = rows.row[m + 1][rest];
  }
  for (int j = 0; j < m; ++j) {
    const auto &row = rows.row[1 + j];
    const Real inverse = 1.0 / row[1 + j];
    k.inverses[j] = inverse;
    for (int i = j + 1; i < m; ++i) {
      const Real lower = row[1 + i] * inverse;
      k.L[i * m + j] = lower;
      add(rows.row[1 + i], -lower, row, 1 + m, 1 + i), add(tail[i], -lower, tail[j], wide);
    }
    store(tail[j], k.tail + 8 * j, wide);
    const Vec3<Real> hub{tail[j][0], tail[j][1], tail[j][2]};
    subtract(I, hub, inverse);
    p = p + (-inverse * tail[j][wide - 1]) * hub;
    if (g) {
      const Real share = inverse * tail[j][3];
      for (int a = 0; a < 5; ++a) flow[a] -= share * tail[j][a];
    }
  }
  beyond.A = I, beyond.b = p;
}

// Rows of the inertia of a piece of constant length by columns, what is beyond its tip left out.
template <class Real, class M, class N>
inline void elastic_rows(const Piece<Real> &c, const PieceState<Real> &k, bool last, M m, N P,
                         Rows<Real, M::most, 0> &rows) {
  using Columns = typename Rows<Real, M::most, 0>::Columns;
  const int columns = m + 2, rest = m + 1, stride = padded(m + 2);
  Columns ex[N::most], ey[N::most];  // e_j Theta''_j by columns; in the rest i e_j Omega_j^2, which
                                     // a quarter turn makes -e_j Omega_j^2
  for (int j = 0; j < P; ++j) {
    times(ex[j], k.cosine[j], c.columns + j * stride, columns),
        times(ey[j], k.sine[j], c.columns + j * stride, columns);
    const Real square = k.rate[j] * k.rate[j];
    ex[j].set(rest, -k.sine[j] * square), ey[j].set(rest, k.cosine[j] * square);
  }
  for (int a = 0; a <= m; ++a) fill(rows.row[a], Real(0.0), columns);
  Columns x, y;
  for (int p = 0; p < P; ++p) {  // (16): H = sum_p |sum_j R_pj i e_j Theta''_j|^2
    times(x, c.R[p * P + p], ex[p], columns), times(y, c.R[p * P + p], ey[p], columns);
    for (int j = p + 1; j < P; ++j)
      add(x, c.R[p * P + j], ex[j], columns), add(y, c.R[p * P + j], ey[j], columns);
    for (int a = 0; a <= m; ++a)
      add(rows.row[a], x[a], x, columns, a), add(rows.row[a], y[a], y, columns, a);
  }
  times(x, c.moment[0], ex[0], columns),
      times(y, c.moment[0], ey[0], columns);  // the first moment: i e_j is (-y, x)
  for (int j = 1; j < P; ++j)
    add(x, c.moment[j], ex[j], columns), add(y, c.moment[j], ey[j], columns);
  times(rows.x, Real(-1.0), y, columns), rows.y = x;
  rows.xx = c.mass, rows.xy = 0.0, rows.yy = c.mass;
  rows.row[0].set(0, rows.row[0][0] + c.hub);
  if (c.turning)
    for (int a = 0; a <= m; ++a)
      for (int b = a; b <= m; ++b) rows.row[a].set(b, rows.row[a][b] + c.spin[a * (m + 1) + b]);
  if (!last) return;
  rows.row[0].set(0, rows.row[0][0] + c.tip);  // the payload turns with the tip
  for (int i = 0; i < m; ++i) {
    const Real turning = c.tip * c.tip_angle[i];
    rows.row[0].set(1 + i, rows.row[0][1 + i] + turning);
    for (int l = i; l < m; ++l)
      rows.row[1 + i].set(1 + l, rows.row[1 + i][1 + l] + turning * c.tip_angle[l]);
  }
}

// Condensation of a piece of constant length, from its rows (45) on. force: on its own unknowns.
template <class Real, class M, class N>
inline void condense_elastic(const Piece<Real> &c, PieceState<Real> &k, const Stage<Real> &stage,
                             const Real *force, bool last, M m, N P,
                             ArticulatedInertia<Real> &beyond) {
  const int rest = m + 1;
  Rows<Real, M::most, 0> rows;
  elastic_rows(c, k, last, m, P, rows);
  const Real *q = stage.y + c.own(), *v = stage.v + c.own();
  for (int i = 0; i < m; ++i) {
    rows.row[1 + i].set(rest, rows.row[1 + i][rest] + (c.K[i] * q[i] + c.D[i] * v[i] - force[i]));
    rows.row[1 + i].set(1 + i, rows.row[1 + i][1 + i] + (stage.gq * c.K[i] + stage.gv * c.D[i]));
  }
  if (!last) add_beyond(rows, k, m, 0, padded(m + 2), beyond);
  eliminate(rows, k, m, beyond, static_cast<Real *>(nullptr));
}

}  // namespace flexura
