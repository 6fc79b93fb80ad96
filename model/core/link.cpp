#include "link.hpp"

#include <algorithm>
#include <cmath>

#include "eigen.hpp"
#include "fault.hpp"
#include "kinematics.hpp"
#include "quadrature.hpp"

namespace flexura {
namespace {

using Numbers = std::vector<double>;
constexpr int MOST_SHAPES = 20;  // of a whole link: more polynomials gain nothing that double precision shows

std::size_t at(int row, int column, int width) { return std::size_t(row) * std::size_t(width) + std::size_t(column); }

// Mass per length and bending stiffness at s.
void matter(const std::vector<Interval> &material, double s, double &mass, double &stiffness) {
  std::size_t i = 0;
  while (i + 1 < material.size() && s >= material[i].to) ++i;
  const Interval &here = material[i];
  const double z = s - here.from, *a = here.stiffness;
  mass = here.mass[0] + z * (here.mass[1] + z * here.mass[2]);
  stiffness = a[0] + z * (a[1] + z * (a[2] + z * (a[3] + z * a[4])));
}

// Calls f(s, weight, rho A, EI) at Gauss points of [from, to], interval by interval of the material, so that kinks cost nothing.
template <class F>
void integrate(const std::vector<Interval> &material, double from, double to, int points, F f) {
  const GaussRule rule = gauss(points);
  for (const Interval &part : material) {
    const double a = std::max(from, part.from), b = std::min(to, part.to);
    if (!(b > a)) continue;
    for (int k = 0; k < points; ++k) {
      const double s = 0.5 * (a + b) + 0.5 * (b - a) * rule.u[std::size_t(k)];
      double mass, stiffness;
      matter(material, s, mass, stiffness);
      f(s, 0.5 * (b - a) * rule.weight[std::size_t(k)], mass, stiffness);
    }
  }
}

// Values of the polynomials that a table (rows: P_n, `width` columns) describes at u, scaled.
void table_values(const Numbers &table, int rows, int width, double u, double scale, double *out) {
  Numbers value(std::size_t(rows) + 1), first(value.size()), second(value.size());
  legendre(u, rows - 1, value.data(), first.data(), second.data());
  for (int j = 0; j < width; ++j) out[j] = 0.0;
  for (int n = 0; n < rows; ++n)
    for (int j = 0; j < width; ++j) out[j] += scale * table[at(n, j, width)] * value[std::size_t(n)];
}

// The table (count + 1, count) of the points' integral weights in the variable u.
Numbers integral_table(const GaussRule &rule) {
  const auto rows = lagrange_integrals(rule);
  Numbers out;
  for (const auto &row : rows) out.insert(out.end(), row.begin(), row.end());
  return out;
}

// Mass, first moment and W of a piece on [from, to] (3), and the weights of its tip, from its points' integrals.
void inertia(Draft &out, const std::vector<Interval> &material, double from, double to, const Numbers &table) {
  const int P = out.P;
  const double half = 0.5 * (to - from);
  Numbers w(std::size_t(P), 0.0);
  out.mass = 0.0, out.moment.assign(std::size_t(P), 0.0), out.W.assign(at(P, 0, P), 0.0);
  integrate(material, from, to, P + 2, [&](double s, double weight, double mass, double) {
    table_values(table, P + 1, P, (s - from) / half - 1.0, half, w.data());
    const double dm = mass * weight;
    out.mass += dm;
    for (int j = 0; j < P; ++j) {
      out.moment[std::size_t(j)] += dm * w[std::size_t(j)];
      for (int l = 0; l < P; ++l) out.W[at(j, l, P)] += dm * w[std::size_t(j)] * w[std::size_t(l)];
    }
  });
  out.w.resize(std::size_t(P));
  table_values(table, P + 1, P, 1.0, half, out.w.data());
  out.length = to - from;
}

void add_payload(Draft &out, const Carried &carried) {
  const double m = carried.payload_mass;
  out.mass += m, out.tip = carried.payload_inertia;
  for (int j = 0; j < out.P; ++j) {
    out.moment[std::size_t(j)] += m * out.w[std::size_t(j)];
    for (int l = 0; l < out.P; ++l) out.W[at(j, l, out.P)] += m * out.w[std::size_t(j)] * out.w[std::size_t(l)];
  }
}

// A link that does not bend: one point, the line a straight rod.
Draft rigid(double length, double mass, double centre, double about_centre) {
  Draft out;
  out.m = 0, out.P = 1, out.length = length;
  out.mass = mass, out.moment = {mass * centre}, out.W = {about_centre + mass * centre * centre}, out.w = {length};
  out.rail = 2, out.railing = 2.0, out.rails = {0.5, 0.5};  // w(x) = x = (P_0 + P_1)/2 at u = 2 x - 1
  return out;
}

// Element e of a mesh (6): the first shape x less as much of the bubble 6 x (1 - x) as makes K diagonal.
Draft element(const Link &link, double from, double to) {
  const GaussRule rule = gauss(3);
  Draft out;
  out.m = 2, out.P = 3, out.beta = link.beta;
  const double h = to - from;
  double K11 = 0.0, K12 = 0.0, K22 = 0.0;
  integrate(link.material, from, to, 5, [&](double s, double weight, double, double stiffness) {
    const double x = (s - from) / h, bubble = 6.0 * (1.0 - 2.0 * x), part = weight * stiffness / (h * h);
    K11 += part, K12 += part * bubble, K22 += part * bubble * bubble;
  });
  const bool uniform = link.material.size() == 1 && std::all_of(link.material[0].stiffness + 1, link.material[0].stiffness + 5,
                                                               [](double a) { return a == 0.0; });
  if (uniform) K11 = link.material[0].stiffness[0] / h, K12 = 0.0, K22 = 12.0 * K11;
  const double mix = K12 / K22;
  for (int p = 0; p < 3; ++p) {
    const double x = 0.5 * (1.0 + rule.u[std::size_t(p)]);
    out.B.push_back(x - mix * 6.0 * x * (1.0 - x));
  }
  for (int p = 0; p < 3; ++p) {
    const double x = 0.5 * (1.0 + rule.u[std::size_t(p)]);
    out.B.push_back(6.0 * x * (1.0 - x));
  }
  out.K = {K11 - mix * K12, K22}, out.tip_angle = {1.0, 0.0};
  inertia(out, link.material, from, to, integral_table(rule));
  return out;
}

// Changes m shapes (rows of tables, B) to `kept` sums of them, T (m, kept).
void combine(Draft &out, Numbers &shapes, int rows, const Numbers &T, int kept) {
  const int m = out.m, P = out.P;
  Numbers B(at(kept, 0, P), 0.0), table(at(rows, 0, kept), 0.0), tip(std::size_t(kept), 0.0);
  for (int k = 0; k < kept; ++k)
    for (int i = 0; i < m; ++i) {
      const double part = T[at(i, k, kept)];
      for (int p = 0; p < P; ++p) B[at(k, p, P)] += part * out.B[at(i, p, P)];
      for (int n = 0; n < rows; ++n) table[at(n, k, kept)] += part * shapes[at(n, i, m)];
      tip[std::size_t(k)] += part * out.tip_angle[std::size_t(i)];
    }
  out.m = kept, out.B = B, out.tip_angle = tip, shapes = table;
}

// X^T A X of a symmetric A (m, m) and X (m, k).
Numbers congruent(const Numbers &A, const Numbers &X, int m, int k) {
  Numbers AX(at(m, 0, k), 0.0), out(at(k, 0, k), 0.0);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int c = 0; c < k; ++c) AX[at(i, c, k)] += A[at(i, j, m)] * X[at(j, c, k)];
  for (int i = 0; i < m; ++i)
    for (int a = 0; a < k; ++a)
      for (int c = 0; c < k; ++c) out[at(a, c, k)] += X[at(i, a, k)] * AX[at(i, c, k)];
  return out;
}

// A whole link's shapes of its space, its mass matrix (clamped, payload included) and stiffness. Sums of `shapes` (rows, m).
struct Space {
  Numbers shapes, M, K, tip_force;  // tip_force (m): deflection of the tip
  int rows = 0;
};

// Own modes of a space: `modes` of them (-1: all), and with a follower the static shapes of a tip force and moment. Returns omega^2.
Numbers own_modes(Draft &out, Space &space, int modes, bool follower) {
  const int m = out.m;
  Numbers squares(std::size_t(m), 0.0), X(at(m, 0, m), 0.0);
  eigen_definite(m, space.K.data(), space.M.data(), squares.data(), X.data());
  int kept = modes < 0 ? m : std::min(modes, m);
  if (modes >= 0 && follower && kept < m) {
    const int wide = std::min(kept + 2, m);
    Numbers Y(at(m, 0, wide), 0.0), L = space.K;
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < kept; ++k) Y[at(i, k, wide)] = X[at(i, k, m)];
    cholesky(m, L.data());
    for (int extra = kept; extra < wide; ++extra) {  // K^-1 of the load, what the modes have of it taken off first
      Numbers load = extra == kept ? space.tip_force : out.tip_angle, shape = load;
      solve_lower(m, L.data(), shape.data()), solve_upper(m, L.data(), shape.data());
      for (int k = 0; k < kept; ++k) {
        double part = 0.0;
        for (int i = 0; i < m; ++i) part += X[at(i, k, m)] * load[std::size_t(i)];
        part /= squares[std::size_t(k)];
        for (int i = 0; i < m; ++i) shape[std::size_t(i)] -= part * X[at(i, k, m)];
      }
      double energy = 0.0;
      for (int i = 0; i < m; ++i) energy += shape[std::size_t(i)] * load[std::size_t(i)];
      const double scale = std::sqrt(squares[std::size_t(kept > 0 ? kept - 1 : 0)] / std::max(std::abs(energy), 1e-300));
      for (int i = 0; i < m; ++i) Y[at(i, extra, wide)] = scale * shape[std::size_t(i)];
    }
    const Numbers K = congruent(space.K, Y, m, wide), M = congruent(space.M, Y, m, wide);
    Numbers Z(at(wide, 0, wide), 0.0);
    squares.assign(std::size_t(wide), 0.0);
    eigen_definite(wide, K.data(), M.data(), squares.data(), Z.data());
    X.assign(at(m, 0, wide), 0.0);
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < wide; ++k)
        for (int l = 0; l < wide; ++l) X[at(i, k, wide)] += Y[at(i, l, wide)] * Z[at(l, k, wide)];
    kept = wide;
  } else {
    Numbers lowest(at(m, 0, kept), 0.0);
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < kept; ++k) lowest[at(i, k, kept)] = X[at(i, k, m)];
    X = lowest, squares.resize(std::size_t(kept));
  }
  for (int k = 0; k < kept; ++k) {  // the tip goes to the left
    double tip = 0.0;
    for (int i = 0; i < m; ++i) tip += X[at(i, k, kept)] * space.tip_force[std::size_t(i)];
    if (tip < 0.0)
      for (int i = 0; i < m; ++i) X[at(i, k, kept)] = -X[at(i, k, kept)];
  }
  combine(out, space.shapes, space.rows, X, kept);
  return squares;
}

bool uniform(const std::vector<Interval> &material) {
  return material.size() == 1 && material[0].mass[1] == 0.0 && material[0].mass[2] == 0.0 && material[0].stiffness[1] == 0.0 &&
         material[0].stiffness[2] == 0.0 && material[0].stiffness[3] == 0.0 && material[0].stiffness[4] == 0.0;
}

// How many Legendre shapes describe a whole link: enough for the last of its modes to be right to 1e-5 in a uniform one.
int shape_count(const Link &link) {
  const int mesh = std::min(2 * link.elements, MOST_SHAPES);
  if (link.modes < 0) return mesh;
  const int few = std::min(link.modes, MOST_SHAPES - 5) + 5;
  return uniform(link.material) ? few : std::max(few, mesh);
}

// Shapes (7), the points' B, and stiffness of a link of length `length` from s = from on (in xi: length 1, from as of the exit).
Space whole_space(Draft &out, int count, const GaussRule &rule) {
  Space space;
  space.rows = count + 1;
  out.m = count;
  const Numbers shapes = legendre_shapes(count);  // (count, count + 1)
  space.shapes.assign(at(space.rows, 0, count), 0.0);
  for (int k = 0; k < count; ++k)
    for (int n = 0; n <= count; ++n) space.shapes[at(n, k, count)] = shapes[at(k, n, count + 1)];
  out.B.assign(at(count, 0, out.P), 0.0), out.tip_angle.assign(std::size_t(count), 0.0);
  Numbers value(std::size_t(count), 0.0);
  for (int p = 0; p < out.P; ++p) {
    table_values(space.shapes, space.rows, count, rule.u[std::size_t(p)], 1.0, value.data());
    for (int k = 0; k < count; ++k) out.B[at(k, p, out.P)] = value[std::size_t(k)];
  }
  out.tip_angle[0] = 2.0;  // all others vanish at the tip; by their sums they would to the last digit only
  return space;
}

// Derivatives of the shapes by u: of phi_0 1, of phi_k P_k.
void slopes(int count, double u, double *out) {
  Numbers value(std::size_t(count) + 1), first(value.size()), second(value.size());
  legendre(u, count, value.data(), first.data(), second.data());
  for (int k = 0; k < count; ++k) out[k] = value[std::size_t(k)];
}

// Clamped mass matrix B^T W B (+ payload's inertia) and the tip's deflection of each shape.
void clamped(const Draft &out, Space &space) {
  const int m = out.m, P = out.P;
  Numbers transposed(at(P, 0, m), 0.0);
  for (int i = 0; i < m; ++i)
    for (int p = 0; p < P; ++p) transposed[at(p, i, m)] = out.B[at(i, p, P)];
  space.M = congruent(out.W, transposed, P, m);
  space.tip_force.assign(std::size_t(m), 0.0);
  for (int i = 0; i < m; ++i) {
    for (int p = 0; p < P; ++p) space.tip_force[std::size_t(i)] += out.w[std::size_t(p)] * out.B[at(i, p, P)];
    for (int l = 0; l < m; ++l) space.M[at(i, l, m)] += out.tip * out.tip_angle[std::size_t(i)] * out.tip_angle[std::size_t(l)];
  }
}

// A link of constant length as one piece, in its own modes.
Draft whole(const Link &link, const Carried &carried) {
  Draft out;
  const int count = shape_count(link);
  out.P = count + (link.modes < 0 || carried.follower ? 1 : 0), out.beta = link.beta;
  const GaussRule rule = gauss(out.P);
  const Numbers table = integral_table(rule);
  inertia(out, link.material, 0.0, link.length, table);
  add_payload(out, carried);
  Space space = whole_space(out, count, rule);
  space.K.assign(at(count, 0, count), 0.0);
  Numbers slope(std::size_t(count), 0.0);
  const double per_s = 2.0 / link.length;
  integrate(link.material, 0.0, link.length, count + 3, [&](double s, double weight, double, double stiffness) {
    slopes(count, per_s * s - 1.0, slope.data());
    for (int i = 0; i < count; ++i)
      for (int l = 0; l < count; ++l)
        space.K[at(i, l, count)] += weight * stiffness * per_s * per_s * slope[std::size_t(i)] * slope[std::size_t(l)];
  });
  clamped(out, space);
  out.K = own_modes(out, space, link.modes, carried.follower);
  if (carried.slider) {  // weights and shapes anywhere along the line
    const int P = out.P, width = P + out.m;
    out.rail = std::max(P + 1, space.rows), out.railing = per_s;
    out.rails.assign(at(out.rail, 0, width), 0.0);
    for (int n = 0; n <= P; ++n)
      for (int j = 0; j < P; ++j) out.rails[at(n, j, width)] = 0.5 * link.length * table[at(n, j, P)];
    for (int n = 0; n < space.rows; ++n)
      for (int k = 0; k < out.m; ++k) out.rails[at(n, P + k, width)] = space.shapes[at(n, k, out.m)];
  }
  return out;
}

// A flexible link in a sleeve: the same shapes on xi (8).
Draft sleeved(const Link &link, const Carried &carried) {
  Draft out;
  const int count = shape_count(link);
  out.P = count + 1, out.joint = At::sleeve, out.beta = link.beta, out.length = link.length;
  const GaussRule rule = gauss(out.P);
  const Numbers table = integral_table(rule);
  const int P = out.P;
  out.C.assign(at(P, 0, P), 0.0), out.w.assign(std::size_t(P), 0.0);
  for (int p = 0; p < P; ++p) {
    out.xi.push_back(0.5 * (1.0 + rule.u[std::size_t(p)])), out.weight.push_back(0.5 * rule.weight[std::size_t(p)]);
    table_values(table, P + 1, P, rule.u[std::size_t(p)], 0.5, out.C.data() + p * P);
  }
  table_values(table, P + 1, P, 1.0, 0.5, out.w.data());
  integrate(link.material, 0.0, link.length, 3, [&](double, double weight, double mass, double) { out.mass += weight * mass; });
  out.mass += carried.payload_mass, out.payload = carried.payload_mass, out.tip = carried.payload_inertia;
  Space space = whole_space(out, count, rule);
  if (link.modes >= 0) {  // its modes at the start's free length
    Draft start;
    const double d = link.joint.start, from = link.length - d;
    start.P = P;
    inertia(start, link.material, from, link.length, table);
    add_payload(start, carried);
    start.B = out.B, start.tip_angle = out.tip_angle, start.m = out.m;
    space.K.assign(at(count, 0, count), 0.0);
    Numbers slope(std::size_t(count), 0.0);
    integrate(link.material, from, link.length, count + 3, [&](double s, double weight, double, double stiffness) {
      slopes(count, 2.0 * (s - from) / d - 1.0, slope.data());
      for (int i = 0; i < count; ++i)
        for (int l = 0; l < count; ++l)
          space.K[at(i, l, count)] += weight * stiffness * 4.0 / (d * d) * slope[std::size_t(i)] * slope[std::size_t(l)];
    });
    clamped(start, space);
    own_modes(start, space, link.modes, carried.follower);
    out.m = start.m, out.B = start.B, out.tip_angle = start.tip_angle;
  }
  out.bend.assign(at(out.m, 0, P), 0.0);
  Numbers value(std::size_t(space.rows) + 1), first(value.size()), second(value.size());
  for (int p = 0; p < P; ++p) {
    legendre(rule.u[std::size_t(p)], space.rows - 1, value.data(), first.data(), second.data());
    for (int k = 0; k < out.m; ++k)
      for (int n = 0; n < space.rows; ++n) out.bend[at(k, p, P)] += 2.0 * first[std::size_t(n)] * space.shapes[at(n, k, out.m)];
  }
  for (const Interval &part : link.material) {
    out.material.insert(out.material.end(), {part.from, part.to});
    out.material.insert(out.material.end(), part.mass, part.mass + 3);
    out.material.insert(out.material.end(), part.stiffness, part.stiffness + 5);
  }
  out.intervals = int(link.material.size());
  const int width = P + out.m;
  out.rail = std::max(P + 1, space.rows), out.railing = 2.0, out.K.assign(std::size_t(out.m), 0.0);
  out.rails.assign(at(out.rail, 0, width), 0.0);
  for (int n = 0; n <= P; ++n)
    for (int j = 0; j < P; ++j) out.rails[at(n, j, width)] = 0.5 * table[at(n, j, P)];
  for (int n = 0; n < space.rows; ++n)
    for (int k = 0; k < out.m; ++k) out.rails[at(n, P + k, width)] = space.shapes[at(n, k, out.m)];
  return out;
}

}  // namespace

std::vector<double> legendre_shapes(int count) {
  Numbers out(at(count, 0, count + 1), 0.0);
  out[0] = out[1] = 1.0;
  for (int k = 1; k < count; ++k) {
    out[at(k, k + 1, count + 1)] = 1.0 / (2 * k + 1);
    out[at(k, k - 1, count + 1)] = -1.0 / (2 * k + 1);
  }
  return out;
}

std::vector<Draft> pieces_of(const Link &link, int index, const Carried &carried) {
  const Joint &joint = link.joint;
  const bool sleeve = joint.kind == JointKind::sleeve, flexible = link.elements > 0;
  if (flexible && (link.material.empty() || !(link.length > 0.0)))
    throw Fault(index, "length_m", "expected a length above 0 and a material for a link that bends");
  std::vector<Draft> out;
  if (sleeve) out.push_back(rigid(0.0, 0.0, 0.0, 0.0));  // the sleeve itself, fixed to the link before
  if (!flexible) {
    out.push_back(rigid(link.length, link.mass, link.centre, link.inertia));
    add_payload(out.back(), carried);
    if (sleeve) out.back().offset = -link.length;
  } else if (sleeve) {
    out.push_back(sleeved(link, carried));
  } else if (link.modes >= 0 || carried.slider) {
    out.push_back(whole(link, carried));
  } else {
    for (int e = 0; e < link.elements; ++e)
      out.push_back(element(link, link.length * e / link.elements, e + 1 == link.elements ? link.length : link.length * (e + 1) / link.elements));
    add_payload(out.back(), carried);
  }
  Draft &base = out.front(), &moving = sleeve ? out[1] : out[0];
  base.angle = joint.kind == JointKind::revolute ? 0.0 : joint.angle;
  base.mass += joint.hub_mass, base.hub += joint.hub_inertia;
  moving.joint = joint.kind == JointKind::revolute ? At::revolute : sleeve && flexible ? At::sleeve : At::slider;
  moving.rotor = joint.rotor;
  for (Draft &piece : out) {
    piece.link = index;
    if (piece.m > Free::most || piece.P > Free::most) throw Fault(index, "modes", "expected fewer shapes of a whole link");
  }
  return out;
}

}  // namespace flexura
