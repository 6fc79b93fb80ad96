#include "still.hpp"

#include <algorithm>
#include <cmath>

#include "kinematics.hpp"
#include "sleeve.hpp"

namespace flexura {
namespace {

constexpr double NONE = 1e-13;  // a pivot below this share of the stiffnesses and loads it is made of counts as none

// Weights and shapes of the next hub: at the tip, or under a slider, as in kinematics.hpp.
void next_hub(const Piece<double> &c, const Piece<double> *next, const double *q, StillPiece &out) {
  const bool sleeve = c.joint == At::sleeve;
  const double d = sleeve ? q[c.first] : 1.0;
  if (next == nullptr || next->joint != At::slider) {
    for (int j = 0; j < c.P; ++j) out.w.push_back(d * c.w[j]);
    out.a.assign(c.tip_angle, c.tip_angle + c.m);
    return;
  }
  double x = q[next->first] + next->offset;
  if (sleeve) x = (x - c.length + d) / d;
  double at[2 * Free::most], by[2 * Free::most], twice[2 * Free::most];
  rail_values(c, c.railing * x - 1.0, at, by, twice);
  for (int j = 0; j < c.P; ++j) out.w.push_back(d * at[j]);
  out.a.assign(at + c.P, at + c.P + c.m);
}

// First moments, inertia and stiffness of a sleeved piece at its free length d, (8).
void sleeve_constants(const Piece<double> &c, double d, bool last, StillPiece &out) {
  const int m = c.m, P = c.P;
  for (int p = 0; p < P; ++p) {
    const Matter<double> here = matter_at(c, c.length + d * (c.xi[p] - 1.0));
    const double mu = here.mass * d * c.weight[p], stiffness = here.stiffness * c.weight[p] / d;
    for (int j = 0; j < P; ++j) out.s[j] += mu * d * c.C[p * P + j], out.R.push_back(std::sqrt(mu) * d * c.C[p * P + j]);
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k) out.K[i * m + k] += stiffness * c.bend[i * padded(P) + p] * c.bend[k * padded(P) + p];
  }
  if (last)
    for (int j = 0; j < P; ++j) out.s[j] += c.payload * d * c.w[j], out.R.push_back(std::sqrt(c.payload) * d * c.w[j]);
  const Behind<double> inside = behind(c, c.length - d);
  out.rod = inside.first, out.hub += inside.second;
}

}  // namespace

Still::Still(const Model<double> &model, const double *q, const char *free)
    : n_(model.n), gravity_{model.gravity[0], model.gravity[1]} {
  const std::size_t count = model.pieces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<double> &c = model.pieces[i];
    const int m = c.m, P = c.P;
    StillPiece out;
    out.m = m, out.P = P, out.own = c.own(), out.B = c.B, out.angle = c.angle;
    out.mass = c.mass, out.hub = c.hub, out.rotor = c.rotor, out.tip = i + 1 == count ? c.tip : 0.0;
    if (c.joint == At::revolute) {
      if (free && free[c.link])
        out.joint = c.first;
      else
        out.angle += q[c.first];
    }
    if (i == 0 && c.joint == At::slider) base_ = q[c.first] + c.offset;
    next_hub(c, i + 1 < count ? &model.pieces[i + 1] : nullptr, q, out);
    out.s.assign(P, 0.0), out.K.assign(m * m, 0.0);
    if (c.joint == At::sleeve) {
      sleeve_constants(c, q[c.first], i + 1 == count, out);
    } else {
      out.s.assign(c.moment, c.moment + P), out.R.assign(c.R, c.R + P * P);
      for (int k = 0; k < m; ++k) out.K[k * m + k] = c.K[k];
    }
    out.sine.assign(padded(P), 0.0), out.cosine.assign(padded(P), 0.0), out.J.assign(3 * (m + 1), 0.0);
    std::copy(out.a.begin(), out.a.end(), out.J.begin() + 2 * (m + 1) + 1), out.J[2 * (m + 1)] = 1.0;
    out.L.assign(m * m, 0.0), out.D.assign(m, 0.0), out.tail.assign(3 * m, 0.0);
    pieces_.push_back(std::move(out));
  }
}

double Still::energy(const double *q, const TipLoad &load, double share, double &size) {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  double V = 0.0, x = base_, y = 0.0, phi = 0.0;
  size = 0.0;
  for (StillPiece &c : pieces_) {
    const int m = c.m, P = c.P;
    const double *own = q + c.own;
    phi += c.angle;
    if (c.joint >= 0) phi += q[c.joint];
    Row<double, Free::most> angle, sine, cosine;
    fill(angle, phi, P);
    for (int k = 0; k < m; ++k) add(angle, own[k], c.B + k * padded(P), P);
    sincos(angle, sine, cosine, P);
    store(sine, c.sine.data(), P), store(cosine, c.cosine.data(), P);
    double sx = c.mass * x, sy = c.mass * y, dx = 0.0, dy = 0.0, strain = 0.0;
    if (c.rod != 0.0) {
      sincos(phi, c.hub_sine, c.hub_cosine);
      sx += c.rod * c.hub_cosine, sy += c.rod * c.hub_sine;
    }
    for (int j = 0; j < P; ++j) {
      sx += c.s[j] * c.cosine[j], sy += c.s[j] * c.sine[j];
      dx += c.w[j] * c.cosine[j], dy += c.w[j] * c.sine[j];
    }
    for (int k = 0; k < m; ++k) {
      double bent = 0.0;
      for (int l = 0; l < m; ++l) bent += c.K[k * m + l] * own[l];
      strain += 0.5 * own[k] * bent;
      phi += c.a[k] * own[k];
    }
    x += dx, y += dy;
    V += strain - gx * sx - gy * sy, size += std::fabs(strain) + std::fabs(gx * sx) + std::fabs(gy * sy);
  }
  tip_ = {x, y, phi};
  const double px = share * load.force[0] * x, py = share * load.force[1] * y, turned = share * load.moment * phi;
  size += std::fabs(px) + std::fabs(py) + std::fabs(turned);
  return V - px - py - turned;
}

void Still::gradient(const double *q, const TipLoad &load, double share, double *out) const {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  Vec3<double> b{-share * load.force[0], -share * load.force[1], -share * load.moment};  // V by the next hub's place and angle
  std::fill(out, out + n_, 0.0);
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    const StillPiece &c = pieces_[i];
    const int m = c.m, P = c.P;
    double *own = out + c.own;
    for (int k = 0; k < m; ++k) {
      own[k] = c.a[k] * b.t;
      for (int l = 0; l < m; ++l) own[k] += c.K[k * m + l] * q[c.own + l];
    }
    if (c.rod != 0.0) b.t += c.rod * (gx * c.hub_sine - gy * c.hub_cosine);
    for (int j = 0; j < P; ++j) {  // V by Theta_j
      const double moment = (c.s[j] * gx - c.w[j] * b.x) * c.sine[j] - (c.s[j] * gy - c.w[j] * b.y) * c.cosine[j];
      b.t += moment;
      for (int k = 0; k < m; ++k) own[k] += moment * c.B[k * padded(P) + j];
    }
    b.x -= c.mass * gx, b.y -= c.mass * gy;
    if (c.joint >= 0) out[c.joint] = b.t;
  }
}

namespace {

// Rows of a piece: turning and own unknowns (a and k from 0), upper triangle, and their coupling with the hub's place.
struct StillRows {
  int wide;
  std::vector<double> H, x, y, parts;  // parts (wide): the sizes of what was added to the diagonal
  explicit StillRows(int count) : wide(count), H(count * count, 0.0), x(count, 0.0), y(count, 0.0), parts(count, 0.0) {}
};

// Second derivatives by Theta of a point: `curved` Theta' Theta'; turning (wide): Theta' by columns.
void add_curved(StillRows &rows, double curved, const double *turning) {
  for (int a = 0; a < rows.wide; ++a) {
    rows.parts[a] += std::fabs(curved) * turning[a] * turning[a];
    for (int k = a; k < rows.wide; ++k) rows.H[a * rows.wide + k] += curved * turning[a] * turning[k];
  }
}

// shift times the piece's M: the sum of squares (4), first moments, inertias of hub and payload. T (P, wide): Theta' of the points.
void add_mass(StillRows &rows, const StillPiece &c, double shift, const double *T) {
  const int wide = rows.wide, P = c.P;
  std::vector<double> zx(wide), zy(wide);
  for (std::size_t p = 0; p < c.R.size(); p += std::size_t(P)) {
    std::fill(zx.begin(), zx.end(), 0.0), std::fill(zy.begin(), zy.end(), 0.0);
    for (int j = 0; j < P; ++j)
      for (int a = 0; a < wide; ++a)
        zx[a] += c.R[p + j] * c.cosine[j] * T[j * wide + a], zy[a] += c.R[p + j] * c.sine[j] * T[j * wide + a];
    for (int a = 0; a < wide; ++a)
      for (int k = a; k < wide; ++k) rows.H[a * wide + k] += shift * (zx[a] * zx[k] + zy[a] * zy[k]);
  }
  for (int j = 0; j < P; ++j)
    for (int a = 0; a < wide; ++a)
      rows.x[a] -= shift * c.s[j] * c.sine[j] * T[j * wide + a], rows.y[a] += shift * c.s[j] * c.cosine[j] * T[j * wide + a];
  rows.x[0] -= shift * c.rod * c.hub_sine, rows.y[0] += shift * c.rod * c.hub_cosine;
  rows.H[0] += shift * c.hub;
  const double *jt = c.J.data() + 2 * wide;
  for (int a = 0; a < wide; ++a)
    for (int k = a; k < wide; ++k) rows.H[a * wide + k] += shift * c.tip * jt[a] * jt[k];
}

}  // namespace

int Still::tangent(const TipLoad &load, double share, double shift, bool descend) {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  double fx = -share * load.force[0], fy = -share * load.force[1];  // the true force on the next hub: V by its place
  Sym3<double> A{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  int wrong = 0;
  auto inverse_of = [&](double pivot, double parts) {  // a pivot, and the size of what it is made of
    if (pivot > NONE * parts) return 1.0 / pivot;
    ++wrong;
    return 1.0 / (descend ? std::max(std::fabs(pivot), 1e-6 * parts + 1e-300) : (pivot == 0.0 ? 1e-300 : pivot));
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
      for (int a = 0; a < wide; ++a) jx[a] -= c.w[j] * c.sine[j] * turning[a], jy[a] += c.w[j] * c.cosine[j] * turning[a];
      add_curved(rows, (c.s[j] * gx - c.w[j] * fx) * c.cosine[j] + (c.s[j] * gy - c.w[j] * fy) * c.sine[j], turning);
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

double Still::turn(const double *step) const {
  double most = 0.0, hub = 0.0;
  for (const StillPiece &c : pieces_) {
    if (c.joint >= 0) hub += step[c.joint];
    most = std::max(most, std::fabs(hub));
    for (int j = 0; j < c.P; ++j) {
      double change = hub;
      for (int k = 0; k < c.m; ++k) change += c.B[k * padded(c.P) + j] * step[c.own + k];
      most = std::max(most, std::fabs(change));
    }
    for (int k = 0; k < c.m; ++k) hub += c.a[k] * step[c.own + k];
  }
  return most;
}

}  // namespace flexura
