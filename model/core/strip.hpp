// What a strain gauge or flex sensor on a link tells: how far its tip stands off the tangent at its hub, and at which angle.
#pragma once
#include "model.hpp"
#include "quadrature.hpp"

namespace flexura {

struct Strip {
  double deflection = 0.0;  // [m]
  double slope = 0.0;       // [rad]
};

// Of a link (from 0) at y (n).
inline Strip read_strip(const Model<double> &model, int link, const double *y) {
  Strip out;
  for (int i = model.begin[std::size_t(link)]; i < model.begin[std::size_t(link) + 1]; ++i) {
    const Piece<double> &c = model.pieces[std::size_t(i)];
    const double scale = c.joint == At::sleeve ? y[c.first] : 1.0, *q = y + c.own();
    for (int j = 0; j < c.P; ++j) {
      double angle = out.slope, sine, cosine;
      for (int l = 0; l < c.m; ++l) angle += c.B[l * padded(c.P) + j] * q[l];
      sincos(angle, sine, cosine);
      out.deflection += scale * c.w[j] * sine;
    }
    for (int l = 0; l < c.m; ++l) out.slope += c.tip_angle[l] * q[l];
  }
  return out;
}

}  // namespace flexura
