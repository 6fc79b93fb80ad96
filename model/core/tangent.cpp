// The tangent of a chain at rest: second derivatives of its energy, plus a share of M, as factors of three
// sweeps (still.hpp).
#include <algorithm>
#include <cmath>

#include "still.hpp"

namespace flexura {

namespace {

// A pivot below this share of the stiffnesses and loads that it is made of counts as none.
constexpr double NONE = 1e-13;

// Rows of a piece: turning and own unknowns (a and k from 0), upper triangle, and their coupling with the
// hub's place.
struct StillRows {
  int wide;
  std::vector<double> H, x, y, parts;  // parts (wide): the sizes of what was added to the diagonal
  explicit StillRows(int count)
      : wide(count), H(count * count, 0.0), x(count, 0.0), y(count, 0.0), parts(count, 0.0) {}
};

// Second derivatives by Theta of a point: `curved` Theta' Theta'; turning (wide): Theta' by columns.
void add_curved(StillRows &rows, double curved, const double *turning) {
  for (int a = 0; a < rows.wide; ++a) {
    rows.parts[a] += std::fabs(curved) * turning[a] * turning[a];
    for (int k = a; k < rows.wide; ++k) rows.H[a * rows.wide + k] += curved * turning[a] * turning[k];
  }
}

// shift times the piece's M: the sum of squares (4), first moments, inertias of hub and payload. T (P, wide):
// Theta' of the points.
void add_mass(StillRows &rows, const StillPiece &c, double shift, const double *T) {
  const int wide = rows.wide, P = c.P;
  std::vector<double> zx(wide), zy(wide);
  for (std::size_t p = 0; p < c.R.size(); p += std::size_t(P)) {
    std::fill(zx.begin(), zx.end(), 0.0), std::fill(zy.begin(), zy.end(), 0.0);
    for (int j = 0; j < P; ++j)
      for (int a = 0; a < wide; ++a)
        zx[a] += c.R[p + j] * c.cosine[j] * T[j * wide + a],
            zy[a] += c.R[p + j] * c.sine[j] * T[j * wide + a];
    for (int a = 0; a < wide; ++a)
      for (int k = a; k < wide; ++k) rows.H[a * wide + k] += shift * (zx[a] * zx[k] + zy[a] * zy[k]);
  }
  for (int j = 0; j < P; ++j)
    for (int a = 0; a < wide; ++a)
      rows.x[a] -= shift * c.s[j] * c.sine[j] * T[j * wide + a],
          rows.y[a] += shift * c.s[j] * c.cosine[j] * T[j * wide + a];
  rows.x[0] -= shift * c.rod * c.hub_sine, rows.y[0] += shift * c.rod * c.hub_cosine;
  rows.H[0] += shift * c.hub;
  const double *jt = c.J.data() + 2 * wide;
  for (int a = 0; a < wide; ++a)
    for (int k = a; k < wide; ++k) rows.H[a * wide + k] += shift * c.tip * jt[a] * jt[k];
}

}  // namespace

int Still::tangent(const TipLoad &load, double share, double shift, bool descend) {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  double fx = -share * load.force[0],
         fy = -share * load.force[1];  // the true force on the next hub: V by its place
  Sym3<double> A{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  int wrong = 0;
  auto inverse_of = [&](double pivot, double parts) {  // a pivot, and the size of what it is made of
    if (pivot > NONE * parts) return 1.0 / pivot;
    ++wrong;
    return 1.0 /
           (descend ? std::max(std::fabs(pivot), 1e-6 * parts + 1e-300) : (pivot == 0.0 ? 1e-300 : pivot));
  };
  std::vector<double> T;
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    StillPiece &c = pieces_[i];
    const int m = c.m, P = c.P, wide = m + 1;
    double *jx = c.J.data(), *jy = jx + wide, *jt = jy + wide;
    StillRows rows(wide);
    T.assign(P * wide, 1.0);
    std::fill(jx, jt, 0.0);
    for (int j = 0; j < P; ++j) {
      double *turning = T.data() + j * wide;
      for (int k = 0; k < m; ++k) turning[1 + k] = c.B[k * padded(P) + j];
      for (int a = 0; a < wide; ++a)
        jx[a] -= c.w[j] * c.sine[j] * turning[a], jy[a] += c.w[j] * c.cosine[j] * turning[a];
      add_curved(rows, (c.s[j] * gx - c.w[j] * fx) * c.cosine[j] + (c.s[j] * gy - c.w[j] * fy) * c.sine[j],
                 turning);
    }
    const double behind = c.rod * (gx * c.hub_cosine + gy * c.hub_sine);
    rows.H[0] += behind, rows.parts[0] += std::fabs(behind);
    if (shift != 0.0) add_mass(rows, c, shift, T.data());
    for (int a = 0; a < wide; ++a) {  // J^T A J
      const Vec3<double> pull = A * Vec3<double>{jx[a], jy[a], jt[a]};
      rows.x[a] += pull.x, rows.y[a] += pull.y;
      for (int k = 0; k <= a; ++k) rows.H[k * wide + a] += jx[k] * pull.x + jy[k] * pull.y + jt[k] * pull.t;
    }
    for (int k = 0; k < m; ++k) {
      rows.parts[1 + k] += c.K[k * m + k];
      for (int l = k; l < m; ++l) rows.H[(1 + k) * wide + 1 + l] += c.K[k * m + l];
    }
    fx -= c.mass * gx, fy -= c.mass * gy;
    Sym3<double> I{A.xx + shift * c.mass, A.xy, rows.x[0], A.yy + shift * c.mass, rows.y[0], rows.H[0]};
    for (int k = 0; k < m; ++k)
      c.tail[3 * k] = rows.x[1 + k], c.tail[3 * k + 1] = rows.y[1 + k], c.tail[3 * k + 2] = rows.H[1 + k];
    for (int j = 0; j < m; ++j) {  // own rows: L D L^T
      const double *row = rows.H.data() + (1 + j) * wide + 1, *coupled = c.tail.data() + 3 * j;
      const double inverse = inverse_of(row[j], rows.parts[1 + j] + std::fabs(row[j]));
      c.D[j] = inverse;
      for (int k = j + 1; k < m; ++k) {
        const double lower = row[k] * inverse;
        c.L[k * m + j] = lower;
        for (int l = k; l < m; ++l) rows.H[(1 + k) * wide + 1 + l] -= lower * row[l];
        for (int l = 0; l < 3; ++l) c.tail[3 * k + l] -= lower * coupled[l];
      }
      subtract(I, Vec3<double>{coupled[0], coupled[1], coupled[2]}, inverse);
    }
    A = I;
    if (c.joint < 0) continue;
    c.pull = {A.xt, A.yt, A.tt};  // a free joint turns the hub
    c.inverse = inverse_of(A.tt + shift * c.rotor, std::fabs(rows.H[0]) + rows.parts[0] + std::fabs(A.tt));
    subtract(A, c.pull, c.inverse);
  }
  return wrong;
}

void Still::solve(const double *r, double *x) const {
  std::fill(x, x + n_, 0.0);
  Vec3<double> b{0.0, 0.0, 0.0};  // what is asked of the next hub
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    const StillPiece &c = pieces_[i];
    const int m = c.m, wide = m + 1;
    const double *jx = c.J.data(), *jy = jx + wide, *jt = jy + wide;
    double *own = x + c.own;
    for (int k = 0; k < m; ++k) own[k] = r[c.own + k] + jx[1 + k] * b.x + jy[1 + k] * b.y + jt[1 + k] * b.t;
    b.t = jx[0] * b.x + jy[0] * b.y + b.t;
    for (int j = 0; j < m; ++j) {
      const double share = c.D[j] * own[j], *tail = c.tail.data() + 3 * j;
      for (int k = j + 1; k < m; ++k) own[k] -= c.L[k * m + j] * own[j];
      b.x -= share * tail[0], b.y -= share * tail[1], b.t -= share * tail[2];
    }
    if (c.joint < 0) continue;
    x[c.joint] = r[c.joint] + b.t;
    b = b + (-c.inverse * x[c.joint]) * c.pull;
  }
  Vec3<double> u{0.0, 0.0, 0.0};
  for (const StillPiece &c : pieces_) {
    const int m = c.m, wide = m + 1;
    const double *jx = c.J.data(), *jy = jx + wide, *jt = jy + wide;
    if (c.joint >= 0) {
      x[c.joint] = c.inverse * (x[c.joint] - dot(c.pull, u));
      u.t += x[c.joint];
    }
    double *own = x + c.own;
    for (int k = m - 1; k >= 0; --k) {
      const double *tail = c.tail.data() + 3 * k;
      own[k] = c.D[k] * (own[k] - tail[0] * u.x - tail[1] * u.y - tail[2] * u.t);
      for (int j = k + 1; j < m; ++j) own[k] -= c.L[j * m + k] * own[j];
    }
    Vec3<double> t{u.x + jx[0] * u.t, u.y + jy[0] * u.t, u.t};
    for (int k = 0; k < m; ++k) t = t + own[k] * Vec3<double>{jx[1 + k], jy[1 + k], jt[1 + k]};
    u = t;
  }
}

}  // namespace flexura
