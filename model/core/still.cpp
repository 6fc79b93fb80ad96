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

// First moments and stiffness of a sleeved piece at its free length d, (8).
void sleeve_constants(const Piece<double> &c, double d, bool last, StillPiece &out) {
  const int m = c.m, P = c.P;
  for (int p = 0; p < P; ++p) {
    const Matter<double> here = matter_at(c, c.length + d * (c.xi[p] - 1.0));
    const double mu = here.mass * d * c.weight[p], stiffness = here.stiffness * c.weight[p] / d;
    for (int j = 0; j < P; ++j) out.s[j] += mu * d * c.C[p * P + j];
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k) out.K[i * m + k] += stiffness * c.bend[i * padded(P) + p] * c.bend[k * padded(P) + p];
  }
  if (last)
    for (int j = 0; j < P; ++j) out.s[j] += c.payload * d * c.w[j];
  out.rod = behind(c, c.length - d).first;
}

}  // namespace

Still::Still(const Model<double> &model, const double *q, const char *free)
    : n_(model.n), gravity_{model.gravity[0], model.gravity[1]} {
  const std::size_t count = model.pieces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<double> &c = model.pieces[i];
    const int m = c.m, P = c.P;
    StillPiece out;
    out.m = m, out.P = P, out.own = c.own(), out.B = c.B, out.mass = c.mass, out.angle = c.angle;
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
      out.s.assign(c.moment, c.moment + P);
      for (int k = 0; k < m; ++k) out.K[k * m + k] = c.K[k];
    }
    out.sine.assign(padded(P), 0.0), out.cosine.assign(padded(P), 0.0), out.J.assign(3 * (m + 1), 0.0);
    out.L.assign(m * m, 0.0), out.D.assign(m, 0.0), out.tail.assign(4 * m, 0.0);
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

int Still::newton(const double *q, const TipLoad &load, double share, bool descend, double *step, double &slope) {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  double fx = -share * load.force[0], fy = -share * load.force[1];  // the true force on the next hub: V by its place
  Sym3<double> A{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  Vec3<double> b{fx, fy, -share * load.moment};
  int wrong = 0;
  auto watched = [&](double pivot, double parts) {  // a pivot, and what it is made of
    if (pivot > NONE * parts) return pivot;
    ++wrong;
    return descend ? std::max(std::fabs(pivot), 1e-6 * parts + 1e-300) : (pivot == 0.0 ? 1e-300 : pivot);
  };
  std::vector<double> H, parts, F;
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    StillPiece &c = pieces_[i];
    const int m = c.m, P = c.P, wide = m + 1;
    double *jx = c.J.data(), *jy = jx + wide, *jt = jy + wide;
    std::fill(c.J.begin(), c.J.end(), 0.0);
    H.assign(wide * (wide + 1), 0.0), parts.assign(wide, 0.0), F.assign(3 * wide, 0.0);  // H: last column the gradient
    auto add_point = [&](double moment, double w, double sine, double cosine, auto turning) {
      const double across = moment * (gx * sine - gy * cosine);  // gradient by Theta of -g . s e
      const double curved = (moment * gx - w * fx) * cosine + (moment * gy - w * fy) * sine;
      for (int a = 0; a < wide; ++a) {
        const double ta = turning(a);
        jx[a] -= w * sine * ta, jy[a] += w * cosine * ta;
        H[a * (wide + 1) + wide] += across * ta;
        parts[a] += std::fabs(curved) * ta * ta;
        for (int k = a; k < wide; ++k) H[a * (wide + 1) + k] += curved * ta * turning(k);
      }
    };
    for (int j = 0; j < P; ++j)
      add_point(c.s[j], c.w[j], c.sine[j], c.cosine[j], [&](int a) { return a == 0 ? 1.0 : c.B[(a - 1) * padded(P) + j]; });
    if (c.rod != 0.0) add_point(c.rod, 0.0, c.hub_sine, c.hub_cosine, [](int a) { return a == 0 ? 1.0 : 0.0; });
    jt[0] = 1.0;
    for (int k = 0; k < m; ++k) jt[1 + k] = c.a[k];
    for (int a = 0; a < wide; ++a) {
      const Vec3<double> pull = A * Vec3<double>{jx[a], jy[a], jt[a]};
      F[a] = pull.x, F[wide + a] = pull.y, F[2 * wide + a] = pull.t;
      H[a * (wide + 1) + wide] += jx[a] * b.x + jy[a] * b.y + jt[a] * b.t;
      for (int k = 0; k <= a; ++k) H[k * (wide + 1) + a] += jx[k] * pull.x + jy[k] * pull.y + jt[k] * pull.t;
    }
    for (int k = 0; k < m; ++k) {
      double bent = 0.0;
      for (int l = 0; l < m; ++l) bent += c.K[k * m + l] * q[c.own + l];
      H[(1 + k) * (wide + 1) + wide] += bent, parts[1 + k] += c.K[k * m + k];
      for (int l = k; l < m; ++l) H[(1 + k) * (wide + 1) + 1 + l] += c.K[k * m + l];
    }
    fx -= c.mass * gx, fy -= c.mass * gy;
    b.x -= c.mass * gx, b.y -= c.mass * gy;
    Sym3<double> I{A.xx, A.xy, F[0], A.yy, F[wide], H[0]};
    Vec3<double> p{b.x, b.y, H[wide]};
    double *tail = c.tail.data();
    for (int k = 0; k < m; ++k) {
      tail[4 * k] = F[1 + k], tail[4 * k + 1] = F[wide + 1 + k], tail[4 * k + 2] = H[1 + k];
      tail[4 * k + 3] = H[(1 + k) * (wide + 1) + wide];
    }
    for (int j = 0; j < m; ++j) {  // own rows: L D L^T
      const double *row = H.data() + (1 + j) * (wide + 1) + 1;
      const double pivot = watched(row[j], parts[1 + j] + std::fabs(row[j])), inverse = 1.0 / pivot;
      c.D[j] = inverse;
      for (int k = j + 1; k < m; ++k) {
        const double lower = row[k] * inverse;
        c.L[k * m + j] = lower;
        for (int l = k; l < m; ++l) H[(1 + k) * (wide + 1) + 1 + l] -= lower * row[l];
        for (int l = 0; l < 4; ++l) tail[4 * k + l] -= lower * tail[4 * j + l];
      }
      const Vec3<double> hub{tail[4 * j], tail[4 * j + 1], tail[4 * j + 2]};
      subtract(I, hub, inverse);
      p = p + (-inverse * tail[4 * j + 3]) * hub;
    }
    A = I, b = p;
    if (c.joint >= 0) {  // a free joint turns the hub; the hub before keeps its own angle
      const double pivot = watched(A.tt, std::fabs(H[0]) + parts[0] + std::fabs(A.tt));
      c.joint_pivot = 1.0 / pivot, c.joint_rest = b.t;
      c.joint_pull[0] = A.xt, c.joint_pull[1] = A.yt, c.joint_pull[2] = A.tt;
      const Vec3<double> pull{A.xt, A.yt, A.tt};
      subtract(A, pull, c.joint_pivot);
      b = b + (-c.joint_pivot * c.joint_rest) * pull;
    }
  }
  std::fill(step, step + n_, 0.0);
  slope = 0.0;
  Vec3<double> u{0.0, 0.0, 0.0};
  for (const StillPiece &c : pieces_) {
    const int m = c.m, wide = m + 1;
    if (c.joint >= 0) {
      const double turning = -c.joint_pivot * (c.joint_rest + c.joint_pull[0] * u.x + c.joint_pull[1] * u.y + c.joint_pull[2] * u.t);
      slope -= c.joint_rest * c.joint_rest * c.joint_pivot;
      step[c.joint] = turning, u.t += turning;
    }
    double *own = step + c.own;
    for (int k = m - 1; k >= 0; --k) {
      const double *tail = c.tail.data() + 4 * k;
      slope -= tail[3] * tail[3] * c.D[k];
      own[k] = -c.D[k] * (tail[0] * u.x + tail[1] * u.y + tail[2] * u.t + tail[3]);
      for (int j = k + 1; j < m; ++j) own[k] -= c.L[j * m + k] * own[j];
    }
    const double *jx = c.J.data(), *jy = jx + wide, *jt = jy + wide;
    Vec3<double> t{u.x + jx[0] * u.t, u.y + jy[0] * u.t, u.t};
    for (int k = 0; k < m; ++k) t.x += jx[1 + k] * own[k], t.y += jy[1 + k] * own[k], t.t += jt[1 + k] * own[k];
    u = t;
  }
  return wrong;
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
