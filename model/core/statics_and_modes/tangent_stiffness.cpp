// The tangent of a chain at rest (51): second derivatives of its energy, plus a share of M, as
// factors of sweeps over the pieces (potential_energy.hpp).
#include <algorithm>
#include <cmath>

#include "dynamics/piece/kinematics.hpp"
#include "statics_and_modes/potential_energy.hpp"

namespace flexura {

namespace {

// A pivot below this share of the stiffnesses and loads that it is made of counts as none.
constexpr double NONE = 1e-13;

// Theta' at a piece's points (P, m + 1) by turning and own unknowns.
template <class M, class N>
struct Turning {
  double T[N::most * (M::most + 1)];
  Turning(const PieceAtRest &c, M m, N P) {
    for (int j = 0; j < P; ++j) {
      T[j * (m + 1)] = 1.0;
      for (int k = 0; k < m; ++k) T[j * (m + 1) + 1 + k] = c.B[k * padded(P) + j];
    }
  }
};

// Rows of a piece: turning and own unknowns (m + 1), upper triangle, and their coupling with the
// hub's place.
template <int N>
struct StillRows {
  double H[N * N], x[N], y[N], parts[N];  // parts: the sizes of what was added to the diagonal
};

// The piece's M in turning, own unknowns and the hub's place: the sum of squares (16), first
// moments, inertias of hub and payload.
template <class M, class N>
void weigh(PieceAtRest &c, M m, N P) {
  const int wide = m + 1;
  const Turning<M, N> turning(c, m, P);
  const double *T = turning.T, *jt = c.J + 2 * wide;
  double zx[M::most + 1], zy[M::most + 1];
  for (int a = 0; a < wide; ++a)
    for (int k = a; k < wide; ++k) c.inertia[a * wide + k] = c.tip * jt[a] * jt[k];
  c.inertia[0] += c.hub;
  if (c.spin)
    for (int a = 0; a < wide; ++a)
      for (int k = a; k < wide; ++k) c.inertia[a * wide + k] += c.spin[a * wide + k];
  for (int p = 0; p < c.squares; ++p) {
    for (int a = 0; a < wide; ++a) zx[a] = zy[a] = 0.0;
    for (int j = 0; j < P; ++j)
      for (int a = 0; a < wide; ++a)
        zx[a] += c.R[p * P + j] * c.cosine[j] * T[j * wide + a],
            zy[a] += c.R[p * P + j] * c.sine[j] * T[j * wide + a];
    for (int a = 0; a < wide; ++a)
      for (int k = a; k < wide; ++k) c.inertia[a * wide + k] += zx[a] * zx[k] + zy[a] * zy[k];
  }
  for (int a = 0; a < wide; ++a)
    for (int k = 0; k < a; ++k) c.inertia[a * wide + k] = c.inertia[k * wide + a];
  for (int a = 0; a < wide; ++a) {
    double x = 0.0, y = 0.0;
    for (int j = 0; j < P; ++j)
      x -= c.s[j] * c.sine[j] * T[j * wide + a], y += c.s[j] * c.cosine[j] * T[j * wide + a];
    c.first[2 * a] = x, c.first[2 * a + 1] = y;
  }
  c.first[0] -= c.rod * c.hub_sine, c.first[1] += c.rod * c.hub_cosine;
}

// The share and direction of gravity, the true force on the next hub (V by its place), and A beyond
// it.
struct StillBeyond {
  double gx, gy, fx, fy, shift;
  Sym3<double> A;
};

// Forms a piece's rows of (51), eliminates its own unknowns, and leaves A of its hub in `beyond`;
// gives the size of what A's turning is made of.
template <class M, class N, class Pivot>
double condense(PieceAtRest &c, StillBeyond &beyond, Pivot inverse_of, M m, N P) {
  const int wide = m + 1;
  const Turning<M, N> points(c, m, P);
  double *jx = c.J, *jy = jx + wide, *jt = jy + wide;
  StillRows<M::most + 1> rows;
  for (int a = 0; a < wide * wide; ++a) rows.H[a] = 0.0;
  for (int a = 0; a < wide; ++a) rows.x[a] = rows.y[a] = rows.parts[a] = jx[a] = jy[a] = 0.0;
  for (int j = 0; j < P; ++j) {
    const double *turning = points.T + j * wide, sine = c.sine[j], cosine = c.cosine[j];
    const double curved = (c.s[j] * beyond.gx - c.w[j] * beyond.fx) * cosine +
                          (c.s[j] * beyond.gy - c.w[j] * beyond.fy) * sine;
    for (int a = 0; a < wide; ++a) {
      jx[a] -= c.w[j] * sine * turning[a], jy[a] += c.w[j] * cosine * turning[a];
      rows.parts[a] += std::fabs(curved) * turning[a] * turning[a];
      for (int k = a; k < wide; ++k) rows.H[a * wide + k] += curved * turning[a] * turning[k];
    }
  }
  const double rod_moment = c.rod * (beyond.gx * c.hub_cosine + beyond.gy * c.hub_sine),
               shift = beyond.shift;
  rows.H[0] += rod_moment, rows.parts[0] += std::fabs(rod_moment);
  if (shift != 0.0)
    for (int a = 0; a < wide; ++a) {
      rows.x[a] += shift * c.first[2 * a], rows.y[a] += shift * c.first[2 * a + 1];
      for (int k = a; k < wide; ++k) rows.H[a * wide + k] += shift * c.inertia[a * wide + k];
    }
  const Sym3<double> A = beyond.A;
  for (int a = 0; a < wide; ++a) {  // J^T A J
    const Vec3<double> pull = A * Vec3<double>{jx[a], jy[a], jt[a]};
    rows.x[a] += pull.x, rows.y[a] += pull.y;
    for (int k = 0; k <= a; ++k)
      rows.H[k * wide + a] += jx[k] * pull.x + jy[k] * pull.y + jt[k] * pull.t;
  }
  for (int k = 0; k < m; ++k) {
    rows.parts[1 + k] += c.K[k * m + k];
    for (int l = k; l < m; ++l) rows.H[(1 + k) * wide + 1 + l] += c.K[k * m + l];
  }
  beyond.fx -= c.mass * beyond.gx, beyond.fy -= c.mass * beyond.gy;
  Sym3<double> I{A.xx + shift * c.mass, A.xy,      rows.x[0],
                 A.yy + shift * c.mass, rows.y[0], rows.H[0]};
  const double size = std::fabs(rows.H[0]) + rows.parts[0];
  for (int j = 0; j < m; ++j) {  // own rows: L D L^T
    const double *row = rows.H + (1 + j) * wide + 1;
    const double inverse = inverse_of(row[j], rows.parts[1 + j] + std::fabs(row[j]));
    const Vec3<double> coupled{rows.x[1 + j], rows.y[1 + j], rows.H[1 + j]};
    for (int k = j + 1; k < m; ++k) {
      const double lower = row[k] * inverse;
      c.L[k * m + j] = lower;
      for (int l = k; l < m; ++l) rows.H[(1 + k) * wide + 1 + l] -= lower * row[l];
      rows.x[1 + k] -= lower * coupled.x, rows.y[1 + k] -= lower * coupled.y;
      rows.H[1 + k] -= lower * coupled.t;
    }
    subtract(I, coupled, inverse);
    c.D[j] = inverse;
    c.tail[3 * j] = coupled.x, c.tail[3 * j + 1] = coupled.y, c.tail[3 * j + 2] = coupled.t;
  }
  beyond.A = I;
  return size;
}

// The motion of the next hub from that of a piece's own, u, and its own unknowns.
template <class M>
void next_motion(const PieceAtRest &c, const double *own, Vec3<double> &u, M m) {
  const double *jx = c.J, *jy = jx + m + 1, *jt = jy + m + 1;
  u.x += jx[0] * u.t, u.y += jy[0] * u.t;
  for (int k = 0; k < m; ++k) u = u + own[k] * Vec3<double>{jx[1 + k], jy[1 + k], jt[1 + k]};
}

}  // namespace

void ChainAtRest::weigh() {
  for (PieceAtRest &c : pieces_)
    sized<double>(c.m, c.P, [&](auto m, auto P) { flexura::weigh(c, m, P); });
  weighed_ = true;
}

int ChainAtRest::tangent(const TipLoad &load, double share, double shift, bool descend) {
  if (shift != 0.0 && !weighed_) weigh();
  StillBeyond beyond{share * gravity_[0],
                     share * gravity_[1],
                     -share * load.force[0],
                     -share * load.force[1],
                     shift,
                     {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
  int wrong = 0;
  auto inverse_of = [&](double pivot,
                        double parts) {  // a pivot, and the size of what it is made of
    if (pivot > NONE * parts) return 1.0 / pivot;
    ++wrong;
    return 1.0 / (descend ? std::max(std::fabs(pivot), 1e-6 * parts + 1e-300)
                          : (pivot == 0.0 ? 1e-300 : pivot));
  };
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    PieceAtRest &c = pieces_[i];
    double size = 0.0;
    sized<double>(c.m, c.P, [&](auto m, auto P) { size = condense(c, beyond, inverse_of, m, P); });
    if (c.joint < 0) continue;
    Sym3<double> &A = beyond.A;  // a free joint turns the hub
    c.pull = {A.xt, A.yt, A.tt};
    c.inverse = inverse_of(A.tt + c.spring + shift * c.rotor, size + std::fabs(A.tt) + c.spring);
    subtract(A, c.pull, c.inverse);
  }
  return wrong;
}

void ChainAtRest::solve(const double *r, double *x) const {
  Vec3<double> b{0.0, 0.0, 0.0};  // what is asked of the next hub
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    const PieceAtRest &c = pieces_[i];
    sized<double>(c.m, c.P, [&, right = r + c.own, own = x + c.own](auto m, auto) {
      const double *jx = c.J, *jy = jx + m + 1, *jt = jy + m + 1;
      for (int k = 0; k < m; ++k)
        own[k] = right[k] + jx[1 + k] * b.x + jy[1 + k] * b.y + jt[1 + k] * b.t;
      b.t = jx[0] * b.x + jy[0] * b.y + b.t;
      for (int j = 0; j < m; ++j) {
        const double share = c.D[j] * own[j], *tail = c.tail + 3 * j;
        for (int k = j + 1; k < m; ++k) own[k] -= c.L[k * m + j] * own[j];
        b.x -= share * tail[0], b.y -= share * tail[1], b.t -= share * tail[2];
      }
    });
    if (c.held >= 0) x[c.held] = 0.0;
    if (c.joint < 0) continue;
    x[c.joint] = r[c.joint] + b.t;
    b = b + (-c.inverse * x[c.joint]) * c.pull;
  }
  Vec3<double> u{0.0, 0.0, 0.0};
  for (const PieceAtRest &c : pieces_) {
    if (c.joint >= 0) {
      x[c.joint] = c.inverse * (x[c.joint] - dot(c.pull, u));
      u.t += x[c.joint];
    }
    sized<double>(c.m, c.P, [&, own = x + c.own](auto m, auto) {
      for (int k = m - 1; k >= 0; --k) {
        const double *tail = c.tail + 3 * k;
        own[k] = c.D[k] * (own[k] - tail[0] * u.x - tail[1] * u.y - tail[2] * u.t);
        for (int j = k + 1; j < m; ++j) own[k] -= c.L[j * m + k] * own[j];
      }
      next_motion(c, own, u, m);
    });
  }
}

void ChainAtRest::mass_times(const double *x, double *out) {
  if (!weighed_) weigh();
  Vec3<double> u{0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const PieceAtRest &c = pieces_[i];
    if (c.held >= 0) out[c.held] = 0.0;
    if (c.joint >= 0) u.t += x[c.joint], out[c.joint] = c.rotor * x[c.joint];
    sized<double>(c.m, c.P, [&, own = x + c.own, rows = out + c.own](auto m, auto) {
      Vec3<double> wrench{c.mass * u.x + c.first[0] * u.t, c.mass * u.y + c.first[1] * u.t,
                          c.first[0] * u.x + c.first[1] * u.y + c.inertia[0] * u.t};
      for (int k = 0; k < m; ++k) {
        const double *first = c.first + 2 * (1 + k), *row = c.inertia + (1 + k) * (m + 1);
        wrench = wrench + own[k] * Vec3<double>{first[0], first[1], row[0]};
        double force = first[0] * u.x + first[1] * u.y + row[0] * u.t;
        for (int l = 0; l < m; ++l) force += row[1 + l] * own[l];
        rows[k] = force;
      }
      wrenches_[i] = wrench;
      next_motion(c, own, u, m);
    });
  }
  Vec3<double> b{0.0, 0.0, 0.0};  // on the next hub
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    const PieceAtRest &c = pieces_[i];
    sized<double>(c.m, c.P, [&, rows = out + c.own](auto m, auto) {
      const double *jx = c.J, *jy = jx + m + 1, *jt = jy + m + 1;
      for (int k = 0; k < m; ++k) rows[k] += jx[1 + k] * b.x + jy[1 + k] * b.y + jt[1 + k] * b.t;
      b = wrenches_[i] + Vec3<double>{b.x, b.y, jx[0] * b.x + jy[0] * b.y + b.t};
    });
    if (c.joint >= 0) out[c.joint] += b.t;
  }
}

}  // namespace flexura
