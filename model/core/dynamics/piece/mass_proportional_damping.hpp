// Damping that is proportional to mass (26): alpha times the straight, clamped link's own M, on its
// elastic unknowns. M v is formed along the straight line, where the slope is Theta' and the
// deflection its integral; nothing moves lengthwise to first order.
#pragma once
#include "dynamics/piece/sleeve.hpp"

namespace flexura {

// rows (m) += alpha M rate of the free length of a sleeved piece, d long.
template <class Real>
inline void add_sleeve_damping(const Piece<Real> &c, const Real &alpha, const Real &d,
                               const Real *rate, bool last, Real *rows) {
  const int m = c.m, P = c.P;
  Real tip = 0.0;
  for (int k = 0; k < m; ++k) tip += c.tip_angle[k] * rate[k];
  for (int p = 0; p < P + last; ++p) {  // the last: the payload at the tip
    const bool end = p == P;
    const Real mu = end ? c.payload : free_length_material(c, d, p).mass * d * c.weight[p];
    const Real *C = end ? c.w : c.C + p * P;
    Real lever[Free::most], deflection = 0.0;
    for (int k = 0; k < m; ++k) {
      lever[k] = 0.0;
      for (int j = 0; j < P; ++j) lever[k] += d * C[j] * c.B[k * padded(P) + j];
      deflection += lever[k] * rate[k];
    }
    for (int k = 0; k < m; ++k) rows[k] += alpha * mu * lever[k] * deflection;
  }
  for (int k = 0; last && k < m; ++k) rows[k] += alpha * c.tip * c.tip_angle[k] * tip;
}

// Force across and moment at the tip that accelerations of it, across and turning, take for a
// payload whose centre is off the tip of a straight link (111).
template <class Real>
inline void pull_tool(const Piece<Real> &tool, const Real &deflection, const Real &slope, Real &up,
                      Real &moment) {
  Real sine, cosine;
  sincos(tool.angle, sine, cosine);
  const Real along = tool.moment[0] * cosine;
  up = tool.mass * deflection + along * slope;
  moment = along * deflection + tool.R[0] * tool.R[0] * slope;
}

// The same as add_sleeve_damping, of such a payload.
template <class Real>
inline void add_tool_damping(const Piece<Real> &c, const Piece<Real> &tool, const Real &alpha,
                             const Real &d, const Real *rate, Real *rows) {
  Real lever[Free::most], deflection = 0.0, slope = 0.0, up, moment;
  for (int k = 0; k < c.m; ++k) {
    lever[k] = 0.0;
    for (int j = 0; j < c.P; ++j) lever[k] += d * c.w[j] * c.B[k * padded(c.P) + j];
    deflection += lever[k] * rate[k], slope += c.tip_angle[k] * rate[k];
  }
  pull_tool(tool, deflection, slope, up, moment);
  for (int k = 0; k < c.m; ++k) rows[k] += alpha * (lever[k] * up + c.tip_angle[k] * moment);
}

// out, n values, += sum over links of alpha M_clamped v, at (y, v), n values each: y matters for
// the free length of sleeved links only.
template <class Real>
void add_mass_damping(const Model<Real> &model, const Real *y, const Real *v, Real *out) {
  for (int link = 0; link < model.links(); ++link) {
    const int begin = model.line[std::size_t(link)], end = model.begin[std::size_t(link) + 1];
    const bool last = link + 1 == model.links();
    const Real alpha = model.alpha[std::size_t(link)];
    if (worst(abs(alpha)) == 0.0) continue;
    const Piece<Real> &only = model.pieces[std::size_t(end) - 1];
    if (only.joint == HubJoint::sleeve) {
      add_sleeve_damping(only, alpha, y[only.first], v + only.own(), last, out + only.own());
      if (last && model.tool())
        add_tool_damping(only, *model.tool(), alpha, y[only.first], v + only.own(),
                         out + only.own());
      continue;
    }
    std::vector<Real> force(std::size_t(end - begin)), turning(force.size());  // on the piece's hub
    Real deflection = 0.0, slope = 0.0;
    for (int i = begin; i < end; ++i) {
      const Piece<Real> &c = model.pieces[std::size_t(i)];
      const Real *rate = v + c.own();
      Real *row = out + c.own(), &up = force[std::size_t(i - begin)],
           &moment = turning[std::size_t(i - begin)];
      up = c.mass * deflection, moment = 0.0;
      std::vector<Real> z(std::size_t(c.P)), W(z.size(), Real(0.0));
      for (int j = 0; j < c.P; ++j) {
        z[std::size_t(j)] = slope;
        for (int k = 0; k < c.m; ++k) z[std::size_t(j)] += c.B[k * padded(c.P) + j] * rate[k];
        up += c.moment[j] * z[std::size_t(j)];
      }
      for (int p = 0; p < c.P; ++p) {  // W z = R^T R z
        Real x = 0.0;
        for (int j = p; j < c.P; ++j) x += c.R[p * c.P + j] * z[std::size_t(j)];
        for (int j = p; j < c.P; ++j) W[std::size_t(j)] += c.R[p * c.P + j] * x;
      }
      for (int j = 0; j < c.P; ++j) {
        const Real own = W[std::size_t(j)] + c.moment[j] * deflection;
        moment += own;
        for (int k = 0; k < c.m; ++k) row[k] += alpha * c.B[k * padded(c.P) + j] * own;
      }
      if (c.turning)
        for (int a = 0; a <= c.m; ++a) {
          Real own = c.spin[a * (c.m + 1)] * slope;
          for (int k = 0; k < c.m; ++k) own += c.spin[a * (c.m + 1) + 1 + k] * rate[k];
          if (a == 0)
            moment += own;
          else
            row[a - 1] += alpha * own;
        }
      Real tip = slope;
      for (int j = 0; j < c.P; ++j) deflection += c.w[j] * z[std::size_t(j)];
      for (int k = 0; k < c.m; ++k) tip += c.tip_angle[k] * rate[k];
      if (last && i + 1 == end) {
        moment += c.tip * tip;
        for (int k = 0; k < c.m; ++k) row[k] += alpha * c.tip * c.tip_angle[k] * tip;
      }
      slope = tip;
    }
    Real up = 0.0, moment = 0.0;  // of all beyond, at the piece's tip
    if (last && model.tool()) pull_tool(*model.tool(), deflection, slope, up, moment);
    for (int i = end; i-- > begin;) {
      const Piece<Real> &c = model.pieces[std::size_t(i)];
      Real reach = 0.0;
      for (int k = 0; k < c.m; ++k) {
        Real lever = 0.0;
        for (int j = 0; j < c.P; ++j) lever += c.w[j] * c.B[k * padded(c.P) + j];
        out[c.own() + k] += alpha * (lever * up + c.tip_angle[k] * moment);
      }
      for (int j = 0; j < c.P; ++j) reach += c.w[j];
      moment = turning[std::size_t(i - begin)] + moment + reach * up;
      up += force[std::size_t(i - begin)];
    }
  }
}

}  // namespace flexura
