#include "dynamics/places/point_loads.hpp"

#include <cmath>

#include "dynamics/piece/sleeve.hpp"
#include "numbers/quadrature.hpp"

namespace flexura {
namespace {

// A point on a piece, as weights of the tangents at the piece's points (4) and of its unknowns (2),
// and how it moves as the piece slides through its sleeve (29), (31).
struct Station {
  int piece = 0;
  double w[Free::most] = {}, b[Free::most] = {};    // place [m] by e_j; angle by unknowns
  double flow_x = 0.0, flow_y = 0.0, flow_t = 0.0;  // place and angle by the sleeve's unknown
  double inside = 0.0;  // place on the sleeve's axis before its exit, below 0 [m]
};

// The shapes b (m) at u in [-1, 1]: the polynomial through their values at the Gauss points and at
// the tip.
void shapes_at(const Piece<double> &c, double u, double *b) {
  const LineRule &rule = line_rule(c.P);
  double value[MOST_POINTS + 1], first[MOST_POINTS + 1], second[MOST_POINTS + 1];
  auto through_points = [&](double at, int k) {
    legendre(at, c.P, value, first, second);
    double sum = 0.0;
    for (int j = 0; j < c.P; ++j) {
      double l = 0.0;
      for (int n = 0; n <= c.P; ++n) l += rule.integrals[std::size_t(n * c.P + j)] * first[n];
      sum += l * c.B[k * padded(c.P) + j];
    }
    return sum;
  };
  for (int k = 0; k < c.m; ++k) {
    const double left = c.tip_angle[k] - through_points(1.0, k);
    b[k] = through_points(u, k) + left * value[c.P];  // P_P is zero at the points and 1 at the tip
  }
}

// The point at the abscissa s of a link, after `outward_kinematics`.
Station station_of(const Model<double> &model, const Workspace<double> &work, const double *q,
                   int link, double s) {
  Station out;
  const int last = model.begin[std::size_t(link) + 1] - 1;
  int i = model.line[std::size_t(link)];
  double x = s;
  if (model.pieces[std::size_t(i)].joint == HubJoint::sleeve) {
    const Piece<double> &c = model.pieces[std::size_t(i)];
    const PieceState<double> &k = work.kept[std::size_t(i)];
    out.piece = i;
    const double d = q[c.first], xi = (s - c.length + d) / d;
    double sine, cosine;
    sincos(k.phi, sine, cosine);
    if (xi <= 0.0) {  // in or behind the sleeve, on its axis
      out.flow_x = cosine, out.flow_y = sine, out.inside = xi * d;
      return out;
    }
    double at[2 * Free::most], by[2 * Free::most], twice[2 * Free::most];
    line_point_shapes(c, 2.0 * xi - 1.0, at, by, twice);
    const double left = 1.0 - xi;
    for (int j = 0; j < c.P; ++j) {
      out.w[j] = d * at[j];
      out.flow_x += (at[j] + left * by[j]) * k.cosine[j];
      out.flow_y += (at[j] + left * by[j]) * k.sine[j];
    }
    for (int l = 0; l < c.m; ++l) {
      out.b[l] = at[c.P + l];
      out.flow_t += left / d * by[c.P + l] * q[c.own() + l];
    }
    return out;
  }
  while (i < last && x > model.pieces[std::size_t(i)].length)
    x -= model.pieces[std::size_t(i)].length, ++i;
  const Piece<double> &c = model.pieces[std::size_t(i)];
  out.piece = i;
  if (c.m == 0) {
    out.w[0] = x;
    return out;
  }
  const double u = 2.0 * x / c.length - 1.0;
  line_weights(line_rule(c.P), u, 0.5 * c.length, out.w);
  shapes_at(c, u, out.b);
  return out;
}

// What a load is in the base's axes: force x, y [N] and moment [N m].
Vec3<double> turned(const Piece<double> &c, const PieceState<double> &k, const Station &station,
                    const double *q, const LoadPlace &place, const double *value) {
  if (!place.follower) return {value[0], value[1], value[2]};
  double angle = k.phi, sine, cosine;
  for (int l = 0; l < c.m; ++l) angle += station.b[l] * q[c.own() + l];
  sincos(angle, sine, cosine);
  return {value[0] * cosine - value[1] * sine, value[0] * sine + value[1] * cosine, value[2]};
}

}  // namespace

void add_point_loads(const Model<double> &model, Workspace<double> &work, const LoadPlace *places,
                     int count, const double *values, const double *q, double *out) {
  const std::vector<double> still(std::size_t(model.n), 0.0);
  outward_kinematics(model, work, q, still.data());
  std::vector<Station> stations;
  for (int a = 0; a < count; ++a)
    stations.push_back(station_of(model, work, q, places[a].link, places[a].at));
  Vec3<double> beyond{0.0, 0.0, 0.0};  // on the place of the next hub
  for (std::size_t i = model.pieces.size(); i-- > 0;) {
    const Piece<double> &c = model.pieces[i];
    const PieceState<double> &k = work.kept[i];
    const int stride = padded(columns_of(c)), sleeve = c.joint == HubJoint::sleeve;
    auto meets = [&](int column) {
      return k.tip[column] * beyond.x + k.tip[stride + column] * beyond.y +
             k.tip[2 * stride + column] * beyond.t;
    };
    double *own = out + c.own();
    for (int l = 0; l < c.m; ++l) own[l] += meets(1 + l);
    if (sleeve) out[c.first] += meets(c.m + 1);
    beyond.t = meets(0);
    for (int a = 0; a < count; ++a) {
      const Station &at = stations[std::size_t(a)];
      if (at.piece != int(i)) continue;
      const Vec3<double> load = turned(c, k, at, q, places[a], values + 3 * a);
      beyond.t += load.t;
      for (int l = 0; l < c.m; ++l) own[l] += at.b[l] * load.t;
      for (int j = 0; j < c.P; ++j) {
        const double moment = at.w[j] * (k.cosine[j] * load.y - k.sine[j] * load.x);
        beyond.t += moment;
        for (int l = 0; l < c.m; ++l) own[l] += c.B[l * padded(c.P) + j] * moment;
      }
      if (sleeve) {
        out[c.first] += at.flow_x * load.x + at.flow_y * load.y + at.flow_t * load.t;
        beyond.t += at.inside * (at.flow_x * load.y - at.flow_y * load.x);
      }
      beyond.x += load.x, beyond.y += load.y;
    }
    if (c.joint != HubJoint::none && !sleeve) out[c.first] += dot(k.along, beyond);
  }
}

}  // namespace flexura
