// A robot as the recursion takes it: a chain of pieces with constant numbers, and the memory of one
// evaluation.
//
// A piece is a stretch of inextensible, unshearable line that begins at a hub. With P points j, the
// angle of its tangent is linear in its m unknowns q, Theta_j = phi + sum_k B_jk q_k (2). A rigid
// link is a piece with one point and no unknowns; a link of n elements is n pieces of two unknowns
// with no joint between; a link in its own modes, one that carries a slider, and one in a sleeve
// are one piece. A hub with a radius is a rigid piece before the link's line; with a transmission
// its one unknown is the windup (109). A mass whose centre is off the line is a piece without
// length, turned to the centre, followed by one that turns back (111).
#pragma once
#include <cstddef>
#include <vector>

#include "numbers/planar_vectors.hpp"
#include "numbers/scalars.hpp"
#include "robot/robot.hpp"

namespace flexura {

constexpr int MOST_WHOLE = 16;  // elastic unknowns of a link that is one piece

enum class HubJoint {
  none,
  revolute,
  slider,
  sleeve
};  // the joint at a piece's hub; none: it goes on where the piece before ends

// What a piece has in common with the same piece of every robot of its topology.
struct Shape {
  HubJoint joint = HubJoint::none;
  int link = 0;      // that it belongs to
  int m = 0, P = 1;  // unknowns, points
  int first = 0;     // row of its joint's unknown, or of its first own one, among all unknowns
  int rail = 0;  // Legendre polynomials that describe the line, if the next piece slides along it;
                 // 0: that piece sits at the tip
  int intervals = 0;     // of the material of a sleeved piece
  bool turning = false;  // has lumped inertias that turn with its line
  int own() const { return first + (joint != HubJoint::none); }  // row of the first own unknown
};

// The constants of a piece. Rows of arrays are padded to fours. Arrays lie in Model::numbers.
template <class Real>
struct Piece : Shape {
  Real mass, hub, tip;  // with hub and payload [kg]; inertia of hub and payload [kg m^2]
  Real angle,
      offset;  // of the joint; of a slider: what is added to the unknown to give its abscissa
  Real rotor;  // [kg m^2 or kg]
  Real length, railing;   // [m]; the rail's variable is u = railing * abscissa - 1
  const Real *tip_angle;  // (m): Theta at the tip, per unknown
  const Real *K, *D;      // (m) stiffness and damping [N m/unit^2]
  const Real *B;          // (m, P): Theta at the points, per unknown
  const Real *columns;    // (P, m + 2): 1, B, 0 by columns
  const Real *R;          // (P, P) upper triangle, W = R^T R (16)
  const Real *moment;     // (P): int w dm
  const Real *w;          // (P): weights of the tip's place (4)
  const Real
      *rails;  // (rail, P + m): weights and shapes at any place, as sums of Legendre's polynomials
  const Real *xi, *weight;  // sleeve: (P) points and weights on [0, 1]
  const Real *C;            // sleeve: (P, P) integrals up to the points (32)
  const Real *bend;         // sleeve: (m, P): d Theta / d xi, per unknown
  const Real *material;     // sleeve: (intervals, 10): from, to, mass per length, stiffness (8)
  Real payload, beta;       // sleeve: mass at the tip; D = beta K
  const Real *spin;  // turning: (m + 1, m + 1), lumped inertias by hub's turning and unknowns (110)
};

// What an evaluation leaves of a piece for its next sweep.
template <class Real>
struct PieceState {
  Real phi, omega;         // of the hub
  Vec3<Real> along, pull;  // direction of the joint's motion s; I s
  Vec3<Real> slide;        // direction in which a slider on this piece moves
  Real inverse,
      rest;  // 1 / (s.I s + rotor ...) (held: its denominator); what is left for acceleration
  Real *sine, *cosine, *rate;  // (P) of Theta; Omega
  Real *tip;  // (3, columns): acceleration of the place of the next joint: x, y, angle
  Real *L, *inverses,
      *tail;  // (m, m), (m), (m, 8): elastic rows, factorised; their coupling with x, y, angle,
              // flow, rest
};

inline int columns_of(const Shape &c) { return c.m + 2 + (c.joint == HubJoint::sleeve); }

// A robot's equations. q: [joint of link 1, its elastic unknowns, joint of link 2, ...].
template <class Real>
struct Model {
  int n = 0;
  std::vector<Piece<Real>> pieces;
  std::vector<Real> numbers;        // all arrays of all pieces
  std::vector<int> first, elastic;  // per link: row of its joint; count of its elastic unknowns
  std::vector<int> begin;  // per link: its first and, at link + 1, its last piece + 1; what comes
                           // after the last link's is a payload off the tip
  std::vector<int> line;   // per link: the first piece of its line, behind sleeve and hub
  std::vector<JointKind> kind;
  std::vector<char> locked;
  std::vector<Real> viscous, coulomb;  // per link
  std::vector<Real> spring, rest;      // per link: beside the drive (108)
  std::vector<Real> alpha;             // per link: mass-proportional damping [1/s]
  std::vector<double> start, low, high;
  bool mass_damped = false;
  Real gravity[2];

  int links() const { return int(first.size()); }
  bool bends(int link) const { return pieces[std::size_t(begin[std::size_t(link) + 1]) - 1].m > 0; }
  bool elastic_joint(int link) const {  // a transmission is between rotor and hub
    const Piece<Real> &hub = pieces[std::size_t(begin[std::size_t(link)])];
    return hub.m > 0 && begin[std::size_t(link)] < line[std::size_t(link)];
  }
  // The payload, if its centre is off the tip, or null.
  const Piece<Real> *tool() const {
    const std::size_t at = std::size_t(begin.back());
    return at < pieces.size() ? &pieces[at] : nullptr;
  }
  Model() = default;
  Model(Model &&) noexcept = default;
  Model &operator=(Model &&) noexcept = default;
  Model(const Model &) = delete;
};

// Position of a joint's hub from the n unknowns q, or its rate from their rates: behind a
// transmission the rotor's and the windup (109).
template <class Real>
inline double hub_position(const Model<Real> &model, int link, const double *q) {
  const std::size_t i = std::size_t(link);
  const double *joint = q + model.first[i];
  return model.elastic_joint(link) ? joint[0] + joint[1] : joint[0];
}

// Points every array of a piece at its place in a block of numbers; returns how many there are.
// With a null block it only counts.
template <class Real>
std::size_t place_arrays(Piece<Real> &c, const Real *block) {
  std::size_t at = 0;
  auto take = [&](const Real *&array, int count) {
    array = block ? block + at : nullptr;
    at += std::size_t(padded(count));
  };
  const int m = c.m, P = c.P;
  take(c.tip_angle, m), take(c.K, m), take(c.D, m);
  take(c.B, m * padded(P)), take(c.columns, P * padded(m + 2)), take(c.R, P * P), take(c.moment, P),
      take(c.w, P);
  take(c.rails, c.rail * (P + m));
  if (c.turning) take(c.spin, (m + 1) * (m + 1));
  if (c.joint == HubJoint::sleeve)
    take(c.xi, P), take(c.weight, P), take(c.C, P * P), take(c.bend, m * padded(P)),
        take(c.material, c.intervals * 10);
  return at;
}

// The memory of evaluations of one model: one for each thread.
template <class Real>
struct Workspace {
  std::vector<PieceState<Real>> kept;
  std::vector<Real> memory, spare;   // spare: (n) forces less mass-proportional damping
  std::vector<Vec3<Real>> wrenches;  // on the hubs

  explicit Workspace(const Model<Real> &model)
      : kept(model.pieces.size()), spare(std::size_t(model.n)), wrenches(model.pieces.size()) {
    auto room = [](const Shape &c) {
      return 3 * padded(c.P) + 3 * padded(columns_of(c)) + padded(c.m * c.m) + padded(c.m) +
             8 * c.m;
    };
    std::size_t size = 0;
    for (const auto &c : model.pieces) size += std::size_t(room(c));
    memory.resize(size + 4);
    Real *at = memory.data();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const Shape &c = model.pieces[i];
      PieceState<Real> &k = kept[i];
      const int P = padded(c.P), wide = padded(columns_of(c));
      k.sine = at, k.cosine = at + P, k.rate = at + 2 * P, k.tip = at + 3 * P;
      k.L = k.tip + 3 * wide, k.inverses = k.L + padded(c.m * c.m),
      k.tail = k.inverses + padded(c.m);
      at += room(c);
    }
  }
  Workspace(const Workspace &) = delete;
};

}  // namespace flexura
