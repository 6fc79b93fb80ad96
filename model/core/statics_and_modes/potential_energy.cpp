// The chain at rest: constants of its pieces, energy and gradient (potential_energy.hpp).
#include "statics_and_modes/potential_energy.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/piece/kinematics.hpp"
#include "dynamics/piece/sleeve.hpp"

namespace flexura {
namespace {

// Numbers that a piece takes of the memory; `changed`: its weights, moments and masses are not the
// model's.
std::size_t room(const Piece<double> &c, bool changed) {
  const int m = c.m, P = c.P;
  return std::size_t(2 * padded(P) + (m + 1) * (m + 6) + 2 * m * m + 4 * m +
                     (changed ? m + P * (P + 3) : 0));
}

// Weights and shapes of the next hub: at the tip, or under a slider `next`, as in kinematics.hpp.
void put_next_hub(const Piece<double> &c, const Piece<double> *next, const double *q, double *w,
                  double *a) {
  const bool sleeve = c.joint == HubJoint::sleeve;
  const double d = sleeve ? q[c.first] : 1.0;
  if (next == nullptr) {
    for (int j = 0; j < c.P; ++j) w[j] = d * c.w[j];
    std::copy(c.tip_angle, c.tip_angle + c.m, a);
    return;
  }
  double x = q[next->first] + next->offset;
  if (sleeve) x = (x - c.length + d) / d;
  double at[2 * Free::most], by[2 * Free::most], twice[2 * Free::most];
  line_point_shapes(c, c.railing * x - 1.0, at, by, twice);
  for (int j = 0; j < c.P; ++j) w[j] = d * at[j];
  std::copy(at + c.P, at + c.P + c.m, a);
}

// First moments s, masses R, inertia and stiffness of a sleeved piece at its free length d, (33).
void sleeve_constants(const Piece<double> &c, double d, bool last, PieceAtRest &out, double *s,
                      double *R) {
  const int m = c.m, P = c.P;
  for (int p = 0; p < P; ++p) {
    const MaterialPoint<double> here = free_length_material(c, d, p);
    const double mu = here.mass * d * c.weight[p], stiffness = here.stiffness * c.weight[p] / d;
    for (int j = 0; j < P; ++j)
      s[j] += mu * d * c.C[p * P + j], R[p * P + j] = std::sqrt(mu) * d * c.C[p * P + j];
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k)
        out.K[i * m + k] += stiffness * c.bend[i * padded(P) + p] * c.bend[k * padded(P) + p];
  }
  out.squares = P + last;
  if (last)
    for (int j = 0; j < P; ++j)
      s[j] += c.payload * d * c.w[j], R[P * P + j] = std::sqrt(c.payload) * d * c.w[j];
  const RodInSleeve<double> inside = rod_in_sleeve(c, c.length - d);
  out.rod = inside.first, out.hub += inside.second;
}

}  // namespace

ChainAtRest::ChainAtRest(const Model<double> &model, const double *q, const char *free)
    : pieces_(model.pieces.size()),
      wrenches_(model.pieces.size()),
      n_(model.n),
      gravity_{model.gravity[0], model.gravity[1]} {
  const std::size_t count = model.pieces.size();
  auto slides = [&](std::size_t i) {
    return i + 1 < count && model.pieces[i + 1].joint == HubJoint::slider;
  };
  auto changed = [&](std::size_t i) {
    return model.pieces[i].joint == HubJoint::sleeve || slides(i);
  };
  std::size_t size = 0;
  for (std::size_t i = 0; i < count; ++i) size += room(model.pieces[i], changed(i));
  memory_.assign(size, 0.0);
  double *free_memory = memory_.data();
  auto take = [&](int numbers) { return std::exchange(free_memory, free_memory + numbers); };
  for (std::size_t i = 0; i < count; ++i) {
    const Piece<double> &c = model.pieces[i];
    PieceAtRest &out = pieces_[i];
    const int m = c.m, P = c.P, wide = m + 1;
    out.m = m, out.P = P, out.own = c.own(), out.squares = P, out.angle = c.angle;
    out.mass = c.mass, out.hub = c.hub, out.rotor = c.rotor, out.tip = i + 1 == count ? c.tip : 0.0;
    const bool turns = c.joint == HubJoint::revolute && free && free[c.link];
    if (c.joint != HubJoint::none) (turns ? out.joint : out.held) = c.first;
    if (turns)
      out.spring = model.spring[std::size_t(c.link)], out.rest = model.rest[std::size_t(c.link)];
    if (c.turning) out.spin = c.spin;
    if (c.joint == HubJoint::revolute && !turns) out.angle += q[c.first];
    if (i == 0 && c.joint == HubJoint::slider) base_ = q[c.first] + c.offset;
    out.sine = take(padded(P)), out.cosine = take(padded(P)), out.J = take(3 * wide),
    out.K = take(m * m);
    out.inertia = take(wide * wide), out.first = take(2 * wide);
    out.L = take(m * m), out.D = take(m), out.tail = take(3 * m);
    out.B = c.B, out.w = c.w, out.a = c.tip_angle, out.s = c.moment, out.R = c.R;
    if (changed(i)) {
      double *w = take(P), *a = take(m);
      put_next_hub(c, slides(i) ? &model.pieces[i + 1] : nullptr, q, w, a);
      out.w = w, out.a = a;
    }
    if (c.joint == HubJoint::sleeve) {
      double *s = take(P), *R = take((P + 1) * P);
      sleeve_constants(c, q[c.first], i + 1 == count, out, s, R);
      out.s = s, out.R = R;
    } else {
      for (int k = 0; k < m; ++k) out.K[k * m + k] = c.K[k];
    }
    std::copy(out.a, out.a + m, out.J + 2 * wide + 1), out.J[2 * wide] = 1.0;
  }
}

double ChainAtRest::energy(const double *q, const TipLoad &load, double share, double &size) {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  double V = 0.0, x = base_, y = 0.0, phi = 0.0;
  size = 0.0, weighed_ = false;
  for (PieceAtRest &c : pieces_) {
    phi += c.angle;
    double sx = c.mass * x, sy = c.mass * y, dx = 0.0, dy = 0.0, strain = 0.0;
    if (c.joint >= 0) {
      const double wound = q[c.joint] - c.rest;
      phi += q[c.joint], strain = 0.5 * c.spring * wound * wound;
    }
    if (c.rod != 0.0) {
      sincos(phi, c.hub_sine, c.hub_cosine);
      sx += c.rod * c.hub_cosine, sy += c.rod * c.hub_sine;
    }
    sized<double>(c.m, c.P, [&, own = q + c.own](auto m, auto P) {
      Row<double, decltype(P)::most> angle, sine, cosine;
      fill(angle, phi, P);
      for (int k = 0; k < m; ++k) add(angle, own[k], c.B + k * padded(P), P);
      sincos(angle, sine, cosine, P);
      store(sine, c.sine, P), store(cosine, c.cosine, P);
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
    });
    x += dx, y += dy;
    V += strain - gx * sx - gy * sy,
        size += std::fabs(strain) + std::fabs(gx * sx) + std::fabs(gy * sy);
  }
  tip_ = {x, y, phi};
  const double px = share * load.force[0] * x, py = share * load.force[1] * y,
               turned = share * load.moment * phi;
  size += std::fabs(px) + std::fabs(py) + std::fabs(turned);
  return V - px - py - turned;
}

void ChainAtRest::gradient(const double *q, const TipLoad &load, double share, double *out) const {
  const double gx = share * gravity_[0], gy = share * gravity_[1];
  Vec3<double> b{-share * load.force[0], -share * load.force[1],
                 -share * load.moment};  // V by the next hub's place and angle
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    const PieceAtRest &c = pieces_[i];
    sized<double>(c.m, c.P, [&, own = out + c.own](auto m, auto P) {
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
    });
    b.x -= c.mass * gx, b.y -= c.mass * gy;
    if (c.joint >= 0) out[c.joint] = b.t + c.spring * (q[c.joint] - c.rest);
    if (c.held >= 0) out[c.held] = 0.0;
  }
}

double ChainAtRest::largest_turn(const double *step) const {
  double most = 0.0, hub = 0.0;
  for (const PieceAtRest &c : pieces_) {
    if (c.joint >= 0) hub += step[c.joint];
    most = std::max(most, std::fabs(hub));
    sized<double>(c.m, c.P, [&, own = step + c.own](auto m, auto P) {
      for (int j = 0; j < P; ++j) {
        double change = hub;
        for (int k = 0; k < m; ++k) change += c.B[k * padded(P) + j] * own[k];
        most = std::max(most, std::fabs(change));
      }
      for (int k = 0; k < m; ++k) hub += c.a[k] * own[k];
    });
  }
  return most;
}

double ChainAtRest::near_lowest() {
  std::vector<double> x(n_, 0.0), Kx(n_), Mx(n_);
  for (const PieceAtRest &c : pieces_)
    for (int k = 0; k < c.m; ++k) x[c.own + k] = c.a[k] / c.K[k * c.m + k];
  gradient(x.data(), TipLoad{}, 0.0, Kx.data());
  mass_times(x.data(), Mx.data());
  double strain = 0.0, inertia = 0.0;
  for (int k = 0; k < n_; ++k) strain += x[k] * Kx[k], inertia += x[k] * Mx[k];
  return inertia > 0.0 ? strain / inertia : 1.0;
}

}  // namespace flexura
