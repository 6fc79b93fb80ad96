#include "dynamics/places/positions.hpp"

#include "numbers/quadrature.hpp"

namespace flexura {
namespace {

// The point at the abscissa `x` of a bent piece: its place from the hub and the angle there, (2)
// and (4) with Lagrange's polynomials through its points. The angle also has its value at the tip:
// P_P is zero at the points and 1 there.
Pose<double> point_on_piece(const Piece<double> &c, const PieceState<double> &k, const double *q,
                            double x, double length) {
  const LineRule &rule = line_rule(c.P);
  std::vector<double> value(std::size_t(c.P) + 1), first(value.size()), second(value.size());
  const double u = 2.0 * x / length - 1.0;
  std::vector<double> slopes(value.size());  // of the polynomials at the tip
  legendre(1.0, c.P, value.data(), slopes.data(), second.data());
  legendre(u, c.P, value.data(), first.data(), second.data());
  Pose<double> out{0.0, 0.0, k.phi};
  double left = 0.0;  // at the tip
  for (int i = 0; i < c.m; ++i) left += c.tip_angle[i] * q[i];
  for (int j = 0; j < c.P; ++j) {
    double w = 0.0, l = 0.0, end = 0.0, turned = 0.0;
    for (int n = 0; n <= c.P; ++n) {
      w += 0.5 * length * rule.integrals[std::size_t(n * c.P + j)] * value[std::size_t(n)];
      l += rule.integrals[std::size_t(n * c.P + j)] * first[std::size_t(n)];
      end += rule.integrals[std::size_t(n * c.P + j)] * slopes[std::size_t(n)];
    }
    for (int i = 0; i < c.m; ++i) turned += c.B[i * padded(c.P) + j] * q[i];
    out.x += w * k.cosine[j], out.y += w * k.sine[j], out.angle += l * turned;
    left -= end * turned;
  }
  out.angle += left * value[std::size_t(c.P)];
  return out;
}

}  // namespace

void line_points(const Model<double> &model, const Workspace<double> &work, const double *y,
                 int link, const double *s, int count, Pose<double> *out) {
  const int begin = model.line[std::size_t(link)], end = model.begin[std::size_t(link) + 1];
  const std::vector<double> still(std::size_t(model.n), 0.0);
  Hub<double> hub = first_hub(model, y, still.data());
  std::vector<Hub<double>> hubs;
  for (int i = 0; i < end; ++i) {
    const Piece<double> &c = model.pieces[std::size_t(i)];
    hubs.push_back(hub);
    const bool within = std::size_t(i) + 1 < model.pieces.size();
    advance_hub(c, work.kept[std::size_t(i)], still.data(),
                within ? &model.pieces[std::size_t(i) + 1] : nullptr, hub);
  }
  for (int a = 0; a < count; ++a) {
    const bool sleeved = model.pieces[std::size_t(end) - 1].joint == HubJoint::sleeve;
    int i = begin;
    double x = s[a], length = model.pieces[std::size_t(i)].length;
    if (sleeved) {
      const Piece<double> &c = model.pieces[std::size_t(i)];
      length = y[c.first], x = s[a] - c.length + length;
    } else {
      while (i + 1 < end && x > length)
        x -= length, ++i, length = model.pieces[std::size_t(i)].length;
    }
    const Piece<double> &c = model.pieces[std::size_t(i)];
    const PieceState<double> &k = work.kept[std::size_t(i)];
    Pose<double> at{0.0, 0.0, k.phi};
    double sine, cosine;
    sincos(k.phi, sine, cosine);
    if (c.m == 0 || (sleeved && x <= 0.0))
      at.x = x * cosine, at.y = x * sine;
    else
      at = point_on_piece(c, k, y + c.own(), x, length);
    out[a] = {hubs[std::size_t(i)].x + at.x, hubs[std::size_t(i)].y + at.y, at.angle};
  }
}

}  // namespace flexura
