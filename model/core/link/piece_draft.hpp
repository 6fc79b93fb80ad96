// A piece as it is made from a link of the robot file: arrays of its own, not yet in a model.
#pragma once
#include <algorithm>
#include <vector>

#include "numbers/quadrature.hpp"
#include "robot/model.hpp"

namespace flexura {

using Numbers = std::vector<double>;

inline std::size_t at(int row, int column, int width) {
  return std::size_t(row) * std::size_t(width) + std::size_t(column);
}

// A moment of inertia that turns at the rate b_0 of the hub and b_k of the unknowns (110).
struct Spin {
  double inertia = 0.0;
  Numbers b;  // (m)
};

// Names as in Piece. Arrays are not padded.
struct PieceDraft : Shape {
  double mass = 0.0, hub = 0.0, tip = 0.0, angle = 0.0, offset = 0.0, rotor = 0.0, length = 0.0,
         railing = 0.0, payload = 0.0, beta = 0.0;
  Numbers tip_angle, K, B, W, moment, w, rails;  // B (m, P), W (P, P), rails (rail, P + m)
  Numbers xi, weight, C, bend, material;         // of a sleeve
  Numbers D;                                     // (m), if damping is not beta K
  std::vector<Spin> spins;                       // lumped inertias
};

// What stands on a link: a payload at its tip, another link there, a slider along it.
struct Attachments {
  double payload_mass = 0.0, payload_inertia = 0.0, payload_along = 0.0, payload_across = 0.0;
  bool off_tip = false;  // the payload is a piece of its own, behind the link (111)
  bool follower = false, slider = false;
};

// Whether nothing changes along a link.
inline bool uniform(const std::vector<Interval> &material) {
  auto zero = [](const double *from, const double *to) {
    return std::all_of(from, to, [](double a) { return a == 0.0; });
  };
  return material.size() == 1 && zero(material[0].mass + 1, material[0].mass + 3) &&
         zero(material[0].stiffness + 1, material[0].stiffness + 5);
}

// Mass per length and bending stiffness at s.
inline void material_values(const std::vector<Interval> &material, double s, double &mass,
                            double &stiffness) {
  std::size_t i = 0;
  while (i + 1 < material.size() && s >= material[i].to) ++i;
  const Interval &here = material[i];
  const double z = s - here.from, *a = here.stiffness;
  mass = here.mass[0] + z * (here.mass[1] + z * here.mass[2]);
  stiffness = a[0] + z * (a[1] + z * (a[2] + z * (a[3] + z * a[4])));
}

// Calls f(s, weight, rho A, EI) at Gauss points of [from, to], interval by interval of the
// material, so that kinks cost nothing.
template <class F>
void integrate(const std::vector<Interval> &material, double from, double to, int points, F f) {
  const GaussRule &rule = gauss(points);
  for (const Interval &part : material) {
    const double a = std::max(from, part.from), b = std::min(to, part.to);
    if (!(b > a)) continue;
    for (int k = 0; k < points; ++k) {
      const double s = 0.5 * (a + b) + 0.5 * (b - a) * rule.u[std::size_t(k)];
      double mass, stiffness;
      material_values(material, s, mass, stiffness);
      f(s, 0.5 * (b - a) * rule.weight[std::size_t(k)], mass, stiffness);
    }
  }
}

// Mass, first moment and W of a piece on [from, to] (14), and the weights of its tip.
inline void inertia(PieceDraft &out, const std::vector<Interval> &material, double from,
                    double to) {
  const LineRule &rule = line_rule(out.P);
  const std::size_t P = std::size_t(out.P);
  const double length = to - from;
  out.length = length, out.w = rule.tip;
  for (double &w : out.w) w *= length;
  if (uniform(material)) {
    out.mass = material[0].mass[0] * length;
    out.moment = rule.moment, out.W = rule.W;
    for (double &x : out.moment) x *= out.mass * length;
    for (double &x : out.W) x *= out.mass * length * length;
    return;
  }
  Numbers w(P);
  out.mass = 0.0, out.moment.assign(P, 0.0), out.W.assign(P * P, 0.0);
  integrate(material, from, to, out.P + 2, [&](double s, double weight, double mass, double) {
    line_weights(rule, 2.0 * (s - from) / length - 1.0, 0.5 * length, w.data());
    const double dm = mass * weight;
    out.mass += dm;
    for (std::size_t j = 0; j < P; ++j) {
      out.moment[j] += dm * w[j];
      for (std::size_t l = 0; l < P; ++l) out.W[j * P + l] += dm * w[j] * w[l];
    }
  });
}

// A point mass at the place sum_j w_j e_j of the line: m, m w and m w w^T (22), (110).
inline void add_point_mass(PieceDraft &out, double m, const Numbers &w) {
  out.mass += m;
  if (m == 0.0) return;
  for (int j = 0; j < out.P; ++j) {
    out.moment[std::size_t(j)] += m * w[std::size_t(j)];
    for (int l = 0; l < out.P; ++l)
      out.W[at(j, l, out.P)] += m * w[std::size_t(j)] * w[std::size_t(l)];
  }
}

// A payload m_p with the rotary inertia I_tip at the tip: m_p, m_p w, m_p w w^T and I_tip Omega_L^2
// of the kinetic energy (22). One off the tip is a piece of its own: off_tip() of link_pieces.hpp.
inline void add_payload(PieceDraft &out, const Attachments &attached) {
  if (attached.off_tip) return;
  add_point_mass(out, attached.payload_mass, out.w);
  out.tip = attached.payload_inertia;
}

// The lumps of a link that are on a piece from `from` to `to`, the last of its link or not;
// shapes(x, b): what its unknowns turn the line by at x of [0, 1].
template <class F>
void add_lumps(PieceDraft &out, const std::vector<Lump> &lumps, double from, double to, bool last,
               F shapes) {
  out.turning = !lumps.empty();
  for (const Lump &lump : lumps) {
    if (lump.at < from || (lump.at >= to && !last)) continue;
    const double x = std::min((lump.at - from) / (to - from), 1.0);
    Numbers w(std::size_t(out.P)), b(std::size_t(out.m));
    if (x < 1.0)
      line_weights(line_rule(out.P), 2.0 * x - 1.0, 0.5 * (to - from), w.data());
    else
      w = out.w;
    add_point_mass(out, lump.mass, w);
    shapes(x, b.data());
    out.spins.push_back({lump.inertia, b});
  }
}

}  // namespace flexura
