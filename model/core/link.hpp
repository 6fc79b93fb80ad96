// One link as pieces: points, shapes, and the constants of (3), (4) and (5).
#pragma once
#include <vector>

#include "model.hpp"

namespace flexura {

// A piece with arrays of its own, as `assemble` puts it into a model. Not padded; names as in Piece.
struct Draft : Shape {
  double mass = 0.0, hub = 0.0, tip = 0.0, angle = 0.0, offset = 0.0, rotor = 0.0, length = 0.0, railing = 0.0, payload = 0.0, beta = 0.0;
  std::vector<double> tip_angle, K, B, W, moment, w, rails;            // B (m, P), W (P, P), rails (rail, P + m)
  std::vector<double> xi, weight, C, bend, material;         // of a sleeve
};

// What stands on a link: a payload at its tip, another link there, a slider along it.
struct Carried {
  double payload_mass = 0.0, payload_inertia = 0.0;
  bool follower = false, slider = false;
};

// The pieces of link `index` (from 0), from its joint to its tip. Throws Fault.
std::vector<Draft> pieces_of(const Link &link, int index, const Carried &carried);

// Legendre shapes of a whole link (7): phi_0 = P_1 + 1, phi_k = (P_(k+1) - P_(k-1)) / (2 k + 1), as sums of P_0 ... P_count,
// (count, count + 1).
std::vector<double> legendre_shapes(int count);

}  // namespace flexura
