// Kinematics of one piece, the outward sweep (2), (5), (31), (44): angles and rates of every
// piece's points from those of its hub, and the acceleration of the place where the next piece
// sits, column by column: 0 turning, 1 ... m the piece's own unknowns, (m + 1 the flow of a
// sleeve,) last what is there without accelerations.
#pragma once
#include "numbers/quadrature.hpp"
#include "robot/model.hpp"

namespace flexura {

// A size that the compiler knows, so that loops unroll and small arrays stay in registers, and one
// that it does not.
template <int N>
struct Fixed {
  constexpr operator int() const { return N; }
  static constexpr int most = N;
};
struct Free {
  int n;
  operator int() const { return n; }
  static constexpr int most = 48;  // more is refused by `assemble`
};

// Whether code is made for all common sizes. What computes with derivatives does without those of
// links in their own modes, and so does a build for which FLEXURA_FEW_SIZES is defined: it is
// compiled sooner and runs slower, with the same digits.
#ifdef FLEXURA_FEW_SIZES
template <class Real>
constexpr bool many_sizes = false;
#else
template <class Real>
constexpr bool many_sizes = true;
template <int N>
constexpr bool many_sizes<Dual<N> > = false;
#endif

// Calls f with m and P as sizes that the compiler knows, where they are common ones; `many`: those
// of links in their own modes too.
template <class Real, bool many = many_sizes<Real>, class F>
inline void sized(int m, int P, F f) {
  switch (100 * m + P) {
    case 1: return f(Fixed<0>(), Fixed<1>());    // a rigid link
    case 101: return f(Fixed<1>(), Fixed<1>());  // a hub behind its transmission
    case 203: return f(Fixed<2>(), Fixed<3>());  // an element of a mesh
    default: break;
  }
  if constexpr (!many)
    return f(Free{m}, Free{P});
  else
    switch (100 * m + P) {
      case 207: return f(Fixed<2>(), Fixed<7>());  // a link in its own modes, the last of its chain
      case 308: return f(Fixed<3>(), Fixed<8>());
      case 409: return f(Fixed<4>(), Fixed<9>());
      case 408: return f(Fixed<4>(), Fixed<8>());  // the same, followed by another
      default: f(Free{m}, Free{P});
    }
}

// Theta, its sine and cosine, and Omega at a piece's points (2).
template <class Real, class M, class N>
inline void tangent_angles(const Piece<Real> &c, PieceState<Real> &k, const Real *q, const Real *v,
                           M m, N P) {
  Row<Real, N::most> angle, rate, sine, cosine;
  fill(angle, k.phi, P), fill(rate, k.omega, P);
  for (int i = 0; i < m; ++i) {
    add(angle, q[i], c.B + i * padded(P), P);
    add(rate, v[i], c.B + i * padded(P), P);
  }
  sincos(angle, sine, cosine, P);
  store(sine, k.sine, P), store(cosine, k.cosine, P), store(rate, k.rate, P);
}

// The point at the tip of a bent piece of constant length (5): columns of its acceleration, into
// k.tip.
template <class Real, class M, class N>
inline void tip_columns(const Piece<Real> &c, PieceState<Real> &k, M m, N P) {
  const int columns = m + 2, rest = m + 1, stride = padded(m + 2);
  Row<Real, M::most + 2> x, y;
  fill(x, Real(0.0), columns), fill(y, Real(0.0), columns);
  Real restx = 0.0, resty = 0.0;
  for (int j = 0; j < P; ++j) {
    const Real along = c.w[j] * k.cosine[j], across = c.w[j] * k.sine[j],
               square = k.rate[j] * k.rate[j];
    add(x, -across, c.columns + j * stride, columns),
        add(y, along, c.columns + j * stride, columns);
    restx -= along * square, resty -= across * square;
  }
  x.set(rest, restx), y.set(rest, resty);
  store(x, k.tip, columns), store(y, k.tip + stride, columns);
  Real *angle = k.tip + 2 * stride;
  angle[0] = 1.0;
  for (int i = 0; i < m; ++i) angle[1 + i] = c.tip_angle[i];
  angle[rest] = 0.0;
}

// A point on a bent link (3), (4), (30), on a line whose length scales with d (a piece of constant
// length: d = 1): r = d sum_j at_j e_j at the angle phi + sum_k at_(P+k) q_k, where `at` depends on
// xi and `by`, `twice` are its derivatives. d xi' = s; xi to the line's end is `left`; flow: d' of
// a sleeve.
template <class Real>
struct LinePoint {
  const Real *at, *by, *twice;
  Real d, flow, s, left;
};

// Columns of the acceleration (31) of such a point into k.tip; returns the direction in which it
// moves along the line (angle: curvature). phi and omega become the place's own.
template <class Real>
inline Vec3<Real> line_point_columns(const Piece<Real> &c, PieceState<Real> &k, const Real *q,
                                     const Real *v, const LinePoint<Real> &here, Real &phi,
                                     Real &omega) {
  const int m = c.m, P = c.P, sleeve = c.joint == HubJoint::sleeve, rest = m + 1 + sleeve,
            stride = padded(columns_of(c));
  Real *tx = k.tip, *ty = tx + stride, *tt = ty + stride;
  for (int i = 0; i < stride; ++i) tx[i] = ty[i] = tt[i] = 0.0;
  const Real d = here.d, s = here.s, inverse = 1.0 / d, speed = s * inverse;  // speed: xi'
  Vec3<Real> along{0.0, 0.0, 0.0}, reach{0.0, 0.0, 0.0};
  for (int j = 0; j < P; ++j) {
    const Real cosine = k.cosine[j], sine = k.sine[j], rate = k.rate[j];
    const Real x = d * here.at[j] * cosine, y = d * here.at[j] * sine;
    tx[0] -= y, ty[0] += x;
    for (int i = 0; i < m; ++i)
      tx[1 + i] -= y * c.B[i * padded(P) + j], ty[1 + i] += x * c.B[i * padded(P) + j];
    const Real radial = s * speed * here.twice[j] - d * here.at[j] * rate * rate;
    const Real across = 2.0 * (here.flow * here.at[j] + s * here.by[j]) * rate;
    tx[rest] += radial * cosine - across * sine, ty[rest] += radial * sine + across * cosine;
    along.x += here.by[j] * cosine, along.y += here.by[j] * sine;
    reach.x += here.at[j] * cosine, reach.y += here.at[j] * sine;
  }
  tt[0] = 1.0, phi = k.phi, omega = k.omega;
  for (int i = 0; i < m; ++i) {
    const Real b = here.at[P + i], b1 = here.by[P + i], b2 = here.twice[P + i];
    tt[1 + i] = b;
    tt[rest] += 2.0 * speed * b1 * v[i] +
                (speed * speed * b2 - 2.0 * here.flow * inverse * speed * b1) * q[i];
    phi += b * q[i], omega += b * v[i] + speed * b1 * q[i];
    along.t += inverse * b1 * q[i];
  }
  if (sleeve) {  // what moves with the free length
    tx[m + 1] = reach.x + here.left * along.x, ty[m + 1] = reach.y + here.left * along.y;
    tt[m + 1] = here.left * along.t;
  }
  return along;
}

// Weights and shapes at the rail's variable u, and their derivatives by the abscissa (xi of a
// sleeve), from the table of polynomials.
template <class Real>
inline void line_point_shapes(const Piece<Real> &c, const Real &u, Real *at, Real *by,
                              Real *twice) {
  Real value[Free::most + 2], first[Free::most + 2], second[Free::most + 2];
  legendre(u, c.rail - 1, value, first, second);
  const int width = c.P + c.m;
  for (int i = 0; i < width; ++i) at[i] = by[i] = twice[i] = 0.0;
  for (int n = 0; n < c.rail; ++n) {
    const Real one = first[n] * c.railing, two = second[n] * c.railing * c.railing;
    for (int i = 0; i < width; ++i) {
      const Real weight = c.rails[n * width + i];
      at[i] += weight * value[n], by[i] += weight * one, twice[i] += weight * two;
    }
  }
}

// The hub of the next piece: at the tip, or where a slider is. `y`, `v`: all unknowns of the robot;
// next: the next piece or null. Returns the direction in which a slider moves.
template <class Real, class M, class N>
inline Vec3<Real> piece_kinematics(const Piece<Real> &c, PieceState<Real> &k, const Real *y,
                                   const Real *v, const Piece<Real> *next, M m, N P, Real &phi,
                                   Real &omega) {
  const Real *q = y + c.own(), *rate = v + c.own();
  tangent_angles(c, k, q, rate, m, P);
  const bool sleeve = c.joint == HubJoint::sleeve,
             slides = next != nullptr && next->joint == HubJoint::slider;
  if (!sleeve && !slides) {
    tip_columns(c, k, m, P);
    phi = k.phi, omega = k.omega;
    for (int i = 0; i < m; ++i) phi += c.tip_angle[i] * q[i], omega += c.tip_angle[i] * rate[i];
    return {1.0, 0.0, 0.0};
  }
  Real at[2 * Free::most], by[2 * Free::most], twice[2 * Free::most];
  LinePoint<Real> here{at, by, twice, 1.0, 0.0, 0.0, 0.0};
  if (sleeve) here.d = y[c.first], here.flow = v[c.first];
  if (slides) {
    Real x = y[next->first] + next->offset, s = v[next->first];
    if (sleeve)
      x = (x - c.length + here.d) / here.d, here.left = 1.0 - x, s = s + here.flow * here.left;
    here.s = s;
    line_point_shapes(c, c.railing * x - 1.0, at, by, twice);
  } else {
    for (int j = 0; j < P; ++j) at[j] = c.w[j], by[j] = twice[j] = 0.0;
    for (int i = 0; i < m; ++i) at[P + i] = c.tip_angle[i], by[P + i] = twice[P + i] = 0.0;
  }
  return line_point_columns(c, k, q, rate, here, phi, omega);
}

// The outward sweep of the whole chain at (y, v), n values each.
template <class Real>
void outward_kinematics(const Model<Real> &model, Workspace<Real> &work, const Real *y,
                        const Real *v) {
  Real phi = 0.0, omega = 0.0;
  Vec3<Real> slide{1.0, 0.0, 0.0};  // the base's rail
  const std::size_t count = model.pieces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<Real> &c = model.pieces[i];
    PieceState<Real> &k = work.kept[i];
    phi += c.angle;
    k.along = {0.0, 0.0, 1.0};
    if (c.joint == HubJoint::revolute) phi += y[c.first], omega += v[c.first];
    if (c.joint == HubJoint::slider) k.along = slide;
    k.phi = phi, k.omega = omega;
    const Piece<Real> *next = i + 1 < count ? &model.pieces[i + 1] : nullptr;
    sized<Real>(c.m, c.P, [&](auto m, auto P) {
      slide = piece_kinematics(c, k, y, v, next, m, P, phi, omega);
    });
    k.slide = slide;
  }
}

}  // namespace flexura
