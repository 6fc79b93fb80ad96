#include "link/single_piece_link.hpp"

#include <algorithm>
#include <array>
#include <mutex>

namespace flexura {
namespace {

constexpr int MOST_SHAPES =
    20;  // of a link in modes: more polynomials gain nothing that double precision shows

// How many Legendre shapes a whole link has that keeps no number of modes: as many as its mesh has
// unknowns, up to MOST_WHOLE.
int mesh_count(const Link &link) { return std::min(2 * link.elements, MOST_WHOLE); }

// How many describe it in modes: enough for the last mode to be right to 1e-5 in a uniform link.
int shape_count(const Link &link) {
  if (link.modes < 0) return mesh_count(link);
  if (!link.lumps.empty()) return MOST_SHAPES;  // their forces bend the modes sharply
  const int few = std::min(link.modes, MOST_SHAPES - 5) + 5;
  return uniform(link.material) ? few : std::max(few, mesh_count(link));
}

// Shapes (12): phi_0 = P_1 + 1, phi_k = (P_(k+1) - P_(k-1)) / (2 k + 1), at points and as sums of
// Legendre's polynomials.
struct Shapes {
  Numbers sums;    // (count + 1, count)
  Numbers B, tip;  // (count, P), (count)
  Numbers bend;    // (count, P): derivatives by xi = (u + 1) / 2
};

Shapes computed_shapes(int count, int P) {
  Shapes out;
  out.sums.assign(at(count + 1, 0, count), 0.0);
  out.sums[at(0, 0, count)] = out.sums[at(1, 0, count)] = 1.0;
  for (int k = 1; k < count; ++k)
    out.sums[at(k + 1, k, count)] = 1.0 / (2 * k + 1),
                          out.sums[at(k - 1, k, count)] = -1.0 / (2 * k + 1);
  out.B.assign(at(count, 0, P), 0.0), out.bend = out.B, out.tip.assign(std::size_t(count), 0.0);
  Numbers value(std::size_t(count) + 2), first(value.size()), second(value.size());
  out.tip[0] =
      2.0;  // all others vanish at the tip; by their sums they would to the last digit only
  for (int p = 0; p < P; ++p) {
    legendre(line_rule(P).u[std::size_t(p)], count, value.data(), first.data(), second.data());
    for (int k = 0; k < count; ++k)
      for (int n = 0; n <= count; ++n) {
        const double part = out.sums[at(n, k, count)];
        out.B[at(k, p, P)] += part * value[std::size_t(n)],
            out.bend[at(k, p, P)] += 2.0 * part * first[std::size_t(n)];
      }
  }
  return out;
}

// The shapes at P = count or count + 1 points; computed once, when they are asked for first.
const Shapes &shapes(int count, int P) {
  static std::array<Shapes, 2 * (MOST_SHAPES + 1)> table;
  static std::array<std::once_flag, 2 * (MOST_SHAPES + 1)> made;
  const std::size_t k = std::size_t(2 * count + (P > count));
  std::call_once(made.at(k), [&] { table[k] = computed_shapes(count, P); });
  return table[k];
}

void put_shapes(SinglePieceLink &whole, int count) {
  PieceDraft &piece = whole.piece;
  const Shapes &space = shapes(count, piece.P);
  piece.m = count, piece.B = space.B, piece.tip_angle = space.tip;
  whole.shapes = space.sums, whole.rows = count + 1;
}

// Stiffness of the shapes on [from, to]. The derivative of phi_0 by u is 1, of phi_k P_k; uniform:
// int P_k^2 du = 2 / (2 k + 1).
Numbers stiffness_matrix(const std::vector<Interval> &material, double from, double to, int count) {
  Numbers K(at(count, 0, count), 0.0);
  const double per_s = 2.0 / (to - from);
  if (uniform(material)) {
    for (int k = 0; k < count; ++k)
      K[at(k, k, count)] = material[0].stiffness[0] * per_s * (2.0 / (2 * k + 1));
    return K;
  }
  Numbers slope(std::size_t(count) + 1), first(slope.size()), second(slope.size());
  integrate(material, from, to, count + 3, [&](double s, double weight, double, double stiffness) {
    legendre(per_s * (s - from) - 1.0, count, slope.data(), first.data(), second.data());
    for (int i = 0; i < count; ++i)
      for (int l = 0; l < count; ++l)
        K[at(i, l, count)] +=
            weight * stiffness * per_s * per_s * slope[std::size_t(i)] * slope[std::size_t(l)];
  });
  return K;
}

// Mass matrix B W B^T (+ inertias of payload and lumps), the tip's deflection and angle of a
// straight clamped link in its shapes.
void clamp(const PieceDraft &line, const PieceDraft &shaped, const Attachments &attached,
           ClampedLink<double> &out) {
  const int m = shaped.m, P = line.P;
  out.m = m, out.angle = shaped.tip_angle, out.deflection.assign(std::size_t(m), 0.0);
  Numbers transposed(at(P, 0, m));
  for (int i = 0; i < m; ++i)
    for (int p = 0; p < P; ++p) transposed[at(p, i, m)] = shaped.B[at(i, p, P)];
  out.M = congruent(line.W.data(), transposed.data(), P, m);
  for (int i = 0; i < m; ++i) {
    for (int p = 0; p < P; ++p)
      out.deflection[std::size_t(i)] += line.w[std::size_t(p)] * shaped.B[at(i, p, P)];
    for (int l = 0; l < m; ++l)
      out.M[at(i, l, m)] +=
          line.tip * shaped.tip_angle[std::size_t(i)] * shaped.tip_angle[std::size_t(l)];
  }
  for (const Spin &spin : shaped.spins)
    for (int i = 0; i < m; ++i)
      for (int l = 0; l < m; ++l)
        out.M[at(i, l, m)] += spin.inertia * spin.b[std::size_t(i)] * spin.b[std::size_t(l)];
  if (!attached.off_tip) return;
  const double across = attached.payload_across,
               turning = attached.payload_inertia + attached.payload_mass * across * across;
  auto lever = [&](int i) {
    return out.deflection[std::size_t(i)] + attached.payload_along * out.angle[std::size_t(i)];
  };
  for (int i = 0; i < m; ++i)
    for (int l = 0; l < m; ++l)
      out.M[at(i, l, m)] += attached.payload_mass * lever(i) * lever(l) +
                            turning * out.angle[std::size_t(i)] * out.angle[std::size_t(l)];
}

// Changes m shapes for sums of them, X (m, kept).
void combine(SinglePieceLink &whole, const Numbers &X, int kept) {
  PieceDraft &piece = whole.piece;
  const int m = piece.m, P = piece.P;
  Numbers B(at(kept, 0, P), 0.0), sums(at(whole.rows, 0, kept), 0.0), tip(std::size_t(kept), 0.0);
  for (int k = 0; k < kept; ++k)
    for (int i = 0; i < m; ++i) {
      const double part = X[at(i, k, kept)];
      for (int p = 0; p < P; ++p) B[at(k, p, P)] += part * piece.B[at(i, p, P)];
      tip[std::size_t(k)] += part * piece.tip_angle[std::size_t(i)];
    }
  for (Spin &spin : piece.spins) {
    Numbers b(std::size_t(kept), 0.0);
    for (int k = 0; k < kept; ++k)
      for (int i = 0; i < m; ++i) b[std::size_t(k)] += X[at(i, k, kept)] * spin.b[std::size_t(i)];
    spin.b = std::move(b);
  }
  if (whole.slider || whole.sleeve)
    for (int n = 0; n < whole.rows; ++n)
      for (int i = 0; i < m; ++i)
        for (int k = 0; k < kept; ++k)
          sums[at(n, k, kept)] += X[at(i, k, kept)] * whole.shapes[at(n, i, m)];
  piece.m = kept, piece.B = std::move(B), piece.tip_angle = std::move(tip),
  whole.shapes = std::move(sums);
}

// Weights and shapes anywhere along a line of that length, for what slides on it.
void add_rails(SinglePieceLink &whole, double length, double railing) {
  PieceDraft &piece = whole.piece;
  const int P = piece.P, m = piece.m, width = P + m;
  const LineRule &rule = line_rule(P);
  piece.rail = std::max(P + 1, whole.rows), piece.railing = railing;
  piece.rails.assign(at(piece.rail, 0, width), 0.0);
  for (int n = 0; n <= P; ++n)
    for (int j = 0; j < P; ++j)
      piece.rails[at(n, j, width)] = 0.5 * length * rule.integrals[at(n, j, P)];
  for (int n = 0; n < whole.rows; ++n)
    for (int k = 0; k < m; ++k) piece.rails[at(n, P + k, width)] = whole.shapes[at(n, k, m)];
}

}  // namespace

SinglePieceLink begin_single_piece(const Link &link, const Attachments &attached) {
  SinglePieceLink out;
  PieceDraft &piece = out.piece;
  const int count = shape_count(link);
  out.slider = attached.slider, out.follower = attached.follower, out.modes = link.modes,
  out.own = true;
  piece.P = count + (link.modes < 0 || attached.follower ? 1 : 0), piece.beta = link.beta;
  inertia(piece, link.material, 0.0, link.length);
  add_payload(piece, attached);
  put_shapes(out, count);
  add_lumps(piece, link.lumps, 0.0, link.length, true, [&](double x, double *b) {
    Numbers value(std::size_t(count) + 2), first(value.size()), second(value.size());
    legendre(2.0 * x - 1.0, count, value.data(), first.data(), second.data());
    for (int k = 0; k < count; ++k)
      for (int n = 0; n <= count; ++n) b[k] += out.shapes[at(n, k, count)] * value[std::size_t(n)];
  });
  out.clamped.K = stiffness_matrix(link.material, 0.0, link.length, count);
  clamp(piece, piece, attached, out.clamped);
  return out;
}

SinglePieceLink begin_sleeved(const Link &link, const Attachments &attached) {
  SinglePieceLink out;
  PieceDraft &piece = out.piece;
  const int count = shape_count(link), P = count + 1;
  const LineRule &rule = line_rule(P);
  out.sleeve = true, out.follower = attached.follower, out.modes = link.modes,
  out.own = link.modes >= 0;
  piece.P = P, piece.joint = HubJoint::sleeve, piece.beta = link.beta, piece.length = link.length;
  piece.C.resize(at(P, 0, P)), piece.w = rule.tip;
  for (int p = 0; p < P; ++p) {
    piece.xi.push_back(0.5 * (1.0 + rule.u[std::size_t(p)])),
        piece.weight.push_back(0.5 * rule.weight[std::size_t(p)]);
    line_weights(rule, rule.u[std::size_t(p)], 0.5, piece.C.data() + p * P);
  }
  integrate(link.material, 0.0, link.length, 3,
            [&](double, double weight, double mass, double) { piece.mass += weight * mass; });
  if (!attached.off_tip)
    piece.mass += attached.payload_mass, piece.payload = attached.payload_mass,
                                         piece.tip = attached.payload_inertia;
  put_shapes(out, count);
  if (out.own) {  // its modes at the start's free length
    PieceDraft start;
    const double from = link.length - link.joint.start;
    start.P = P;
    inertia(start, link.material, from, link.length);
    add_payload(start, attached);
    out.clamped.K = stiffness_matrix(link.material, from, link.length, count);
    clamp(start, piece, attached, out.clamped);
  }
  for (const Interval &part : link.material) {
    piece.material.insert(piece.material.end(), {part.from, part.to});
    piece.material.insert(piece.material.end(), part.mass, part.mass + 3);
    piece.material.insert(piece.material.end(), part.stiffness, part.stiffness + 5);
  }
  piece.intervals = int(link.material.size());
  return out;
}

PieceDraft finish_single_piece(SinglePieceLink &whole, const Link &link,
                               const ClampedModes<double> &modes) {
  PieceDraft &piece = whole.piece;
  const int shape_number = piece.m;
  if (whole.own) combine(whole, modes.X, modes.count);
  if (!whole.sleeve) {
    piece.K = modes.squares;
    if (whole.slider) add_rails(whole, link.length, 2.0 / link.length);
    return std::move(piece);
  }
  const Numbers &bend = shapes(shape_number, piece.P).bend;
  piece.bend = bend, piece.K.assign(std::size_t(piece.m), 0.0);
  if (whole.own) {
    piece.bend.assign(at(piece.m, 0, piece.P), 0.0);
    for (int k = 0; k < piece.m; ++k)
      for (int i = 0; i < shape_number; ++i)
        for (int p = 0; p < piece.P; ++p)
          piece.bend[at(k, p, piece.P)] += modes.X[at(i, k, piece.m)] * bend[at(i, p, piece.P)];
  }
  add_rails(whole, 1.0, 2.0);
  return std::move(piece);
}

}  // namespace flexura
