// The chain at rest: constants of its pieces, energy and gradient (still.hpp).
#include "still.hpp"

#include <algorithm>
#include <cmath>

#include "kinematics.hpp"
#include "sleeve.hpp"

namespace flexura {
namespace {

// Weights and shapes of the next hub: at the tip, or under a slider, as in kinematics.hpp.
void put_next_hub(const Piece<double> &c, const Piece<double> *next, const double *q, StillPiece &out) {
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
    for (int j = 0; j < P; ++j)
      out.s[j] += mu * d * c.C[p * P + j], out.R.push_back(std::sqrt(mu) * d * c.C[p * P + j]);
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k)
        out.K[i * m + k] += stiffness * c.bend[i * padded(P) + p] * c.bend[k * padded(P) + p];
  }
  if (last)
    for (int j = 0; j < P; ++j)
      out.s[j] += c.payload * d * c.w[j], out.R.push_back(std::sqrt(c.payload) * d * c.w[j]);
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
    put_next_hub(c, i + 1 < count ? &model.pieces[i + 1] : nullptr, q, out);
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
  const double px = share * load.force[0] * x, py = share * load.force[1] * y,
               turned = share * load.moment * phi;
  size += std::fabs(px) + std::fabs(py) + std::fabs(turned);
  return V - px - py - turned;
}

void Still::gradient(const double *q, const TipLoad &load, double share, double *out) const {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  Vec3<double> b{-share * load.force[0], -share * load.force[1],
                 -share * load.moment};  // V by the next hub's place and angle
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
      const double moment =
          (c.s[j] * gx - c.w[j] * b.x) * c.sine[j] - (c.s[j] * gy - c.w[j] * b.y) * c.cosine[j];
      b.t += moment;
      for (int k = 0; k < m; ++k) own[k] += moment * c.B[k * padded(P) + j];
    }
    b.x -= c.mass * gx, b.y -= c.mass * gy;
    if (c.joint >= 0) out[c.joint] = b.t;
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
