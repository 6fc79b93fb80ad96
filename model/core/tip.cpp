#include "tip.hpp"

namespace flexura {

Bend bend(const Model<double> &model, int link, const double *q) {
  Bend out;
  if (model.elastic[std::size_t(link)] == 0) return out;
  const int begin = model.begin[std::size_t(link)], end = model.begin[std::size_t(link) + 1];
  const bool sleeved = model.kind[std::size_t(link)] == JointKind::sleeve;  // its free length is the last piece
  for (int i = sleeved ? end - 1 : begin; i < end; ++i) {
    const Piece<double> &c = model.pieces[std::size_t(i)];
    const double *own = q + c.own(), scale = c.joint == At::sleeve ? q[c.first] : 1.0;
    double across = 0.0;
    for (int j = 0; j < c.P; ++j) {
      double angle = out.slope, sine, cosine;
      for (int l = 0; l < c.m; ++l) angle += c.B[l * padded(c.P) + j] * own[l];
      sincos(angle, sine, cosine);
      across += c.w[j] * sine;
    }
    out.deflection += scale * across;
    for (int l = 0; l < c.m; ++l) out.slope += c.tip_angle[l] * own[l];
  }
  return out;
}

int last_bending(const Model<double> &model) {
  int link = model.links();
  while (link-- > 0)
    if (model.elastic[std::size_t(link)] > 0) break;
  return link;
}

}  // namespace flexura
