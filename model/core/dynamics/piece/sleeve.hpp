// A link that slides through a sleeve (Pb), its free length d an unknown: the line of (12) on xi =
// s/d, 0 at the exit, (32) and (37). A column more: 0 turning, 1 ... m shapes, m + 1 the flow d',
// last the rest.
#pragma once
#include "dynamics/piece/condensation.hpp"

namespace flexura {

// Mass per length and bending stiffness at a point of the material, and their derivatives by its
// abscissa.
template <class Real>
struct MaterialPoint {
  Real mass, mass_slope, stiffness, stiffness_slope;
};

template <class Real>
inline MaterialPoint<Real> material_at(const Piece<Real> &c, const Real &X) {
  MaterialPoint<Real> out{0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < c.intervals; ++i) {
    const Real *a = c.material + 10 * i, z = X - a[0];
    // 1 inside the interval; the first and last go on beyond their ends
    Real inside = 1.0;
    if (i > 0) inside = choose_less(X, a[0], Real(0.0), inside);
    if (i + 1 < c.intervals) inside = choose_less(X, a[1], inside, Real(0.0));
    out.mass += inside * (a[2] + z * (a[3] + z * a[4]));
    out.mass_slope += inside * (a[3] + 2.0 * z * a[4]);
    out.stiffness += inside * (a[5] + z * (a[6] + z * (a[7] + z * (a[8] + z * a[9]))));
    out.stiffness_slope += inside * (a[6] + z * (2.0 * a[7] + z * (3.0 * a[8] + z * (4.0 * a[9]))));
  }
  return out;
}

// The material at point p of the free length d: at the abscissa L + d (xi_p - 1).
template <class Real>
inline MaterialPoint<Real> free_length_material(const Piece<Real> &c, const Real &d, int p) {
  return material_at(c, Real(c.length + d * (c.xi[p] - 1.0)));
}

// Mass, first and second moment about the exit of the material that is still inside or behind, its
// place X - X0 <= 0.
template <class Real>
struct RodInSleeve {
  Real mass, first, second;
};

template <class Real>
inline RodInSleeve<Real> rod_in_sleeve(const Piece<Real> &c, const Real &X0) {
  RodInSleeve<Real> out{0.0, 0.0, 0.0};
  for (int i = 0; i < c.intervals; ++i) {
    const Real *a = c.material + 10 * i;
    const Real from = a[0] - X0;
    Real z = larger(X0 - a[0], Real(0.0));  // how far the interval is inside
    if (i + 1 < c.intervals) z = smaller(z, Real(a[1] - a[0]));
    const Real z2 = z * z, z3 = z2 * z;
    const Real m0 = z * (a[2] + 0.5 * z * a[3] + (1.0 / 3) * z2 * a[4]);
    const Real m1 = z2 * (0.5 * a[2] + (1.0 / 3) * z * a[3] + 0.25 * z2 * a[4]);
    const Real m2 = z3 * ((1.0 / 3) * a[2] + 0.25 * z * a[3] + 0.2 * z2 * a[4]);
    out.mass += m0, out.first += from * m0 + m1, out.second += from * (from * m0 + 2.0 * m1) + m2;
  }
  return out;
}

// Curvature of the line at its points per d: sum_k b'_k q_k.
template <class Real>
inline void bending(const Piece<Real> &c, const Real *q, Real *out) {
  for (int p = 0; p < c.P; ++p) out[p] = 0.0;
  for (int i = 0; i < c.m; ++i)
    for (int p = 0; p < c.P; ++p) out[p] += c.bend[i * padded(c.P) + p] * q[i];
}

// Rows of one point of mass mu: its columns of the material's acceleration, integral weights C (P),
// 1 - xi = left, at the angle of `cosine` and `sine`, the shapes' slopes there B (m, stride apart);
// slope = d mu / d d. The payload is such a point with left = slope = 0.
template <class Real>
struct MassPoint {
  const Real *C, *B;
  Real mu, slope, left, cosine, sine, rate;
};

template <class Real, class R>
inline void add_point(R &rows, const Piece<Real> &c, const PieceState<Real> &k,
                      const MassPoint<Real> &at, const Real &d, const Real &flow) {
  using Columns = typename R::Columns;
  const int m = c.m, columns = m + 3, rest = m + 2, stride = padded(m + 2);
  Columns x, y;
  fill(x, Real(0.0), columns), fill(y, Real(0.0), columns);
  Real reachx = at.left * at.cosine, reachy = at.left * at.sine, turnx = 0.0, turny = 0.0,
       inx = 0.0, iny = 0.0;
  for (int j = 0; j < c.P; ++j) {
    const Real along = at.C[j] * k.cosine[j], across = at.C[j] * k.sine[j], rate = k.rate[j],
               square = rate * rate;
    add(x, -d * across, c.columns + j * stride, m + 1),
        add(y, d * along, c.columns + j * stride, m + 1);
    reachx += along, reachy += across;
    turnx -= across * rate, turny += along * rate;
    inx -= along * square, iny -= across * square;
  }
  const Real sidex = -at.sine * at.left, sidey = at.cosine * at.left;  // (1 - xi) i e
  x.set(m + 1, reachx), y.set(m + 1, reachy);                          // F e
  x.set(rest, d * inx + flow * (2.0 * turnx +
                                sidex * at.rate));  // A = d' (C + F) i e Omega - d C e Omega^2
  y.set(rest, d * iny + flow * (2.0 * turny + sidey * at.rate));
  const Real Vx = d * turnx + flow * reachx, Vy = d * turny + flow * reachy;
  for (int a = 0; a <= m + 1; ++a)
    add(rows.row[a], at.mu * x[a], x, columns, a), add(rows.row[a], at.mu * y[a], y, columns, a);
  add(rows.x, at.mu, x, columns), add(rows.y, at.mu, y, columns);
  // (37): the mass of the point changes with d, and its material moves through it
  const Real side = at.mu * (sidex * Vx + sidey * Vy);
  rows.x.set(rest, rows.x[rest] + flow * at.slope * Vx),
      rows.y.set(rest, rows.y[rest] + flow * at.slope * Vy);
  for (int a = 0; a <= m; ++a) {
    const Real turning = a == 0 ? Real(1.0) : at.B[(a - 1) * padded(c.P)];
    rows.row[a].set(
        rest, rows.row[a][rest] + flow * (at.slope * (x[a] * Vx + y[a] * Vy) - side * turning));
  }
  const Real swept = flow * (reachx * Vx + reachy * Vy) - 0.5 * (Vx * Vx + Vy * Vy);
  rows.row[m + 1].set(rest, rows.row[m + 1][rest] + at.slope * swept + side * at.rate);
}

// K(d) of the free length, EI kappa^2 d summed over the points: (m, m), the upper triangle. What
// the sum leaves by round-off where shapes are orthogonal is taken away: it would weigh on the rows
// of the highest shapes.
template <class Real>
inline void free_length_stiffness(const Piece<Real> &c, const Real &d, Real *K) {
  const int m = c.m, P = c.P;
  for (int i = 0; i < m * m; ++i) K[i] = 0.0;
  for (int p = 0; p < P; ++p) {
    const Real weight = free_length_material(c, d, p).stiffness * c.weight[p] / d;
    for (int i = 0; i < m; ++i)
      for (int l = i; l < m; ++l)
        K[i * m + l] += weight * c.bend[i * padded(P) + p] * c.bend[l * padded(P) + p];
  }
  for (int i = 0; i < m; ++i)
    for (int l = i + 1; l < m; ++l) {
      const Real both = 1e-14 * root(K[i * m + i] * K[l * m + l]);
      K[i * m + l] = choose_less(abs(K[i * m + l]), both, Real(0.0), K[i * m + l]);
    }
}

// Of the force out of a sleeve (36) the part -dU/dd at fixed shapes; with what the loads do at
// fixed shapes it is M0^2 / (2 EI) for a uniform link at rest with the bending moment M0 at the
// exit. Here its negative, the row of d; `bent`: the curvature at the points, per d.
template <class Real>
inline Real sleeve_force_row(const Piece<Real> &c, const Real *bent, const Real &d) {
  const Real inverse = 1.0 / d;
  Real out = 0.0;
  for (int p = 0; p < c.P; ++p) {
    const MaterialPoint<Real> here = free_length_material(c, d, p);
    out += 0.5 * c.weight[p] * bent[p] * bent[p] * inverse *
           (here.stiffness_slope * (c.xi[p] - 1.0) - here.stiffness * inverse);
  }
  return out;
}

// Stiffness and damping of the free length, and the force that bending puts on d (35), (36).
template <class Real, class R>
inline void add_bending(R &rows, const Piece<Real> &c, const Stage<Real> &stage, const Real *q,
                        const Real &d) {
  const int m = c.m, rest = m + 2;
  Real K[MOST_WHOLE * MOST_WHOLE], bent[Free::most];
  free_length_stiffness(c, d, K);
  const Real share = stage.gq + stage.gv * c.beta;
  const Real *y = stage.y + c.own(), *v = stage.v + c.own();
  for (int i = 0; i < m; ++i) {
    Real force = 0.0;
    for (int l = 0; l < m; ++l) force += K[i < l ? i * m + l : l * m + i] * (y[l] + c.beta * v[l]);
    rows.row[1 + i].set(rest, rows.row[1 + i][rest] + force);
    for (int l = i; l < m; ++l)
      rows.row[1 + i].set(1 + l, rows.row[1 + i][1 + l] + share * K[i * m + l]);
  }
  bending(c, q, bent);
  rows.row[m + 1].set(rest, rows.row[m + 1][rest] + sleeve_force_row(c, bent, d));
}

// The rod inside and behind the sleeve, which moves at d' along the axis t = e(phi), and the terms
// of its end at the exit.
template <class Real, class R>
inline void add_rod(R &rows, const Piece<Real> &c, const PieceState<Real> &k, const Real &d,
                    const Real &flow) {
  const int m = c.m, rest = m + 2;
  const Real X0 = c.length - d, lambda = material_at(c, X0).mass, omega = k.omega;
  const RodInSleeve<Real> rod = rod_in_sleeve(c, X0);
  Real sine, cosine;
  sincos(k.phi, sine, cosine);
  rows.x.set(0, rows.x[0] - rod.first * sine), rows.y.set(0, rows.y[0] + rod.first * cosine);
  rows.x.set(m + 1, rows.x[m + 1] + rod.mass * cosine),
      rows.y.set(m + 1, rows.y[m + 1] + rod.mass * sine);
  const Real across = 2.0 * flow * omega * rod.mass,
             along = -omega * omega * rod.first - lambda * flow * flow;
  rows.x.set(rest, rows.x[rest] + along * cosine - across * sine);
  rows.y.set(rest, rows.y[rest] + along * sine + across * cosine);
  rows.row[0].set(0, rows.row[0][0] + rod.second);
  rows.row[0].set(rest, rows.row[0][rest] + 2.0 * flow * omega * rod.first);
  rows.row[m + 1].set(m + 1, rows.row[m + 1][m + 1] + rod.mass);
  rows.row[m + 1].set(
      rest, rows.row[m + 1][rest] - omega * omega * rod.first - 0.5 * lambda * flow * flow);
}

// Rows of a sleeved piece's inertia by columns, what is beyond its tip left out.
template <class Real>
using SleeveRows = Rows<Real, Free::most, 1>;

template <class Real>
void sleeve_rows(const Piece<Real> &c, const PieceState<Real> &k, const Real *y, const Real *v,
                 bool last, SleeveRows<Real> &rows) {
  const int m = c.m, P = c.P, columns = m + 3;
  const Real d = y[c.first], rate = v[c.first];
  for (int a = 0; a <= m + 1; ++a) fill(rows.row[a], Real(0.0), columns);
  fill(rows.x, Real(0.0), columns), fill(rows.y, Real(0.0), columns);
  rows.xx = c.mass, rows.xy = 0.0, rows.yy = c.mass;
  for (int p = 0; p < P; ++p) {
    const Real past = c.xi[p] - 1.0;
    const MaterialPoint<Real> here = free_length_material(c, d, p);
    const MassPoint<Real> point{c.C + p * P,
                                c.B + p,
                                here.mass * d * c.weight[p],
                                c.weight[p] * (here.mass + d * past * here.mass_slope),
                                -past,
                                k.cosine[p],
                                k.sine[p],
                                k.rate[p]};
    add_point(rows, c, k, point, d, rate);
  }
  add_rod(rows, c, k, d, rate);
  if (!last) return;
  const Real none = 0.0;
  add_point(rows, c, k, MassPoint<Real>{c.w, c.B, c.payload, none, none, none, none, none}, d,
            rate);
  rows.row[0].set(0, rows.row[0][0] + c.tip);
  for (int i = 0; i < m; ++i) {
    rows.row[0].set(1 + i, rows.row[0][1 + i] + c.tip * c.tip_angle[i]);
    for (int l = i; l < m; ++l)
      rows.row[1 + i].set(1 + l, rows.row[1 + i][1 + l] + c.tip * c.tip_angle[i] * c.tip_angle[l]);
  }
}

// Condensation of a sleeved piece, by `eliminate`; `flow`, five numbers: its row of d, coupled with
// the hub's x, y, angle, its own pivot and rest.
template <class Real>
void condense_sleeve(const Piece<Real> &c, PieceState<Real> &k, const Real *y, const Real *v,
                     const Stage<Real> &stage, const Real *force, bool last,
                     ArticulatedInertia<Real> &beyond, Real *flow) {
  SleeveRows<Real> rows;
  sleeve_rows(c, k, y, v, last, rows);
  add_bending(rows, c, stage, y + c.own(), y[c.first]);
  for (int i = 0; i < c.m; ++i) rows.row[1 + i].set(c.m + 2, rows.row[1 + i][c.m + 2] - force[i]);
  if (!last) add_beyond(rows, k, c.m, 1, padded(c.m + 3), beyond);
  eliminate(rows, k, c.m, beyond, flow);
}

}  // namespace flexura
