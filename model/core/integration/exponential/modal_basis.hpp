// The modes of a robot at one configuration (87), which exponential steps solve exactly.
//
// With M, K, D the matrices of mass, stiffness and damping there (the drives' linear gains in K and
// D), the modes are the rows of Phi: Phi M Phi^T = 1, Phi K Phi^T = diag(w2); of Phi D Phi^T the
// diagonal is kept. Joints that are held (locked or prescribed) move in no mode but their own, the
// unit vector. The modes need not be exact and need not follow the robot: what they leave out is
// integrated as a force. They are taken again where they have become poor (94).
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "control/inputs.hpp"
#include "control/plant.hpp"
#include "numbers/eigenproblem.hpp"
#include "numbers/modal_vectors.hpp"

namespace flexura {

// Matrices of one robot at a configuration, (n, n) row by row. D is split by who pays: the links'
// material; the joints' own friction and gains are diagonal entries of their rows.
struct Matrices {
  int n;
  std::vector<double> M, K, D, joint_damping,
      joint_stiffness;  // joint_...: (n), zero in elastic rows
  explicit Matrices(int count)
      : n(count),
        M(square(count)),
        K(square(count)),
        D(square(count)),
        joint_damping(std::size_t(count)),
        joint_stiffness(std::size_t(count)) {}
  static std::size_t square(int n) { return std::size_t(n) * std::size_t(n); }
};

template <class Real>
class ModalBasis {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  static constexpr double POOR =
      0.1;  // the change of Phi M Phi^T, and of Phi K Phi^T against w_i w_j, that is put up with
  static constexpr double TURN = 0.05;  // the configuration is looked at after so many radians
                                        // (metres of the tips over the reach),
  static constexpr double FAR =
      8.0;  // or as many times more, at most, where the modes were found to change slowly
  static constexpr double FREE = 1e-4;  // w2 below this is none [rad^2/s^2]

  const int n, chunks, stride;
  Real *phi,
      *rows;  // (n, stride): y = origin + sum_k eta_k phi_k; eta = sum_i (y - origin)_i rows_i
  Real *w2, *own,
      *material;   // (stride): frequency squared, damping; of `own` what the links' material has
  Real *d2, *lag;  // (stride): damping with what is added above the cutoff; added / w2
  double cutoff[LANES];  // modes above this frequency are damped [rad/s]; infinity: none
  int taken[LANES];      // how often modes were taken
  // Does a robot's material have damping, is any added? Of each robot, and of any.
  bool lossy_of[LANES] = {}, damped_of[LANES] = {}, lossy = false, damped = false;

  explicit ModalBasis(int count)
      : n(count), chunks(chunks_of<Real>(count)), stride(room_of<Real>(count)) {
    memory.lay([this](auto take_) {
      for (Real **matrix : {&phi, &rows}) take_(*matrix, n * stride);
      for (Real **vector : {&w2, &own, &material, &d2, &lag, &seen}) take_(*vector, stride);
    });
    for (auto *matrix : {&old, &half, &turned_M, &turned_K, &shapes, &momenta, &lost})
      matrix->resize(Matrices::square(n));
    squares.resize(std::size_t(n));
    for (int k = 0; k < LANES; ++k)
      cutoff[k] = std::numeric_limits<double>::infinity(), taken[k] = 0, patience[k] = TURN,
      gone[k] = 0.0;
  }

  // Has robot k gone far since its configuration was last looked at, so that (94) is to be asked?
  bool has_moved(int k, const Plant<Real> &plant, const Real *q) const {
    if (taken[k] == 0) return true;
    double way = 0.0;
    for (int i = 0; i < plant.joints; ++i) {
      const int e = plant.first[i], end = plant.first[i + 1];
      double bent = 0.0;
      for (int j = e; j < end; ++j) {
        const double x = lane(plant.lever[j] * (q[j] - seen[j]), k);
        if (j == e && !plant.travel.empty()) {
          const double most = lane(plant.travel[i], k);
          if (most > 0.0 && abs(lane(q[j] - seen[j], k)) > most) return true;
        }
        if (j == e)
          way += i > 0 ? abs(x) : 0.0;  // turning the whole robot changes no mode
        else
          bent += x * x;
      }
      way += root(bent);
    }
    return !(way <= patience[k] * lane(plant.reach, k));
  }

  // Takes modes of robot k from its matrices at q, or only if there are none or they are poor
  // there; true if so. `slow` [rad/s]: frequencies below it are as good as zero. zeta: of the
  // damping added above the cutoff.
  bool take(int k, const Matrices &m, const Real *q, const bool *held_row, double slow, double zeta,
            bool if_poor = true) {
    for (int i = 0; i < n; ++i) set_lane(seen[i], k, lane(q[i], k));
    M = m.M, K = m.K, D = m.D;
    for (int i = 0; i < n; ++i) K[at(i, i)] += m.joint_stiffness[std::size_t(i)];
    for (int e = 0; e < n; ++e) {
      if (!held_row[e]) continue;
      for (int j = 0; j < n; ++j)
        for (std::size_t entry : {at(e, j), at(j, e)}) M[entry] = K[entry] = D[entry] = 0.0;
      M[at(e, e)] = 1.0;
    }
    gone[k] += patience[k];
    if (taken[k] > 0) {
      for (int mode = 0; mode < n; ++mode)
        for (int i = 0; i < n; ++i) old[at(i, mode)] = lane(phi[mode * stride + i], k);
      product(n, M, old, half), symmetric_product(n, old, half, turned_M);
      product(n, K, old, half), symmetric_product(n, old, half, turned_K);
      const double changed = change(k, turned_M, turned_K, slow) / POOR;
      patience[k] = smaller(larger(0.7 * gone[k] * (1.0 / root(larger(changed, 1e-3)) - 1.0), TURN),
                            FAR * TURN);  // were it to grow as a square
      if (if_poor && changed < 1.0) return false;
      eigen_pencil(n, turned_K.data(), turned_M.data(), squares.data(),
                   half.data());  // nearly diagonal: soon done
      product(n, old, half, shapes);
    } else {
      eigen_pencil(n, K.data(), M.data(), squares.data(), shapes.data());
    }
    gone[k] = 0.0, patience[k] = TURN;
    const bool loses = std::any_of(D.begin(), D.end(), [](double x) { return x != 0.0; });
    product(n, M, shapes, momenta), lost = D;
    if (loses) product(n, D, shapes, lost);
    const double least = larger(FREE, 1e-14 * squares[std::size_t(n - 1)]);
    for (int mode = 0; mode < n; ++mode) {
      const double square = squares[std::size_t(mode)];
      set_lane(w2[mode], k, square > least ? square : 0.0);
      double decay = 0.0, joints = 0.0;
      for (int i = 0; i < n; ++i) {
        const double x = shapes[at(i, mode)];
        set_lane(phi[mode * stride + i], k, x),
            set_lane(rows[i * stride + mode], k, momenta[at(i, mode)]);
        decay += x * lost[at(i, mode)];
        if (!held_row[i]) joints += x * x * m.joint_damping[std::size_t(i)];
      }
      lossy_of[k] = lossy_of[k] || decay > 0.0, lossy = lossy || decay > 0.0;
      set_lane(material[mode], k, decay), set_lane(own[mode], k, decay + joints);
    }
    damp(k, zeta);
    ++taken[k];
    return true;
  }

  // Robot k's modes above its cutoff get what their damping rate lacks of 2 zeta w (95). More would
  // make the predictor of an overdamped mode unstable, however short the step.
  void damp(int k, double zeta) {
    for (int mode = 0; mode < n; ++mode) {
      const double square = lane(w2[mode], k), w = root(square),
                   missing = 2.0 * zeta * w - lane(own[mode], k),
                   added = square > 0.0 && w > cutoff[k] ? larger(missing, 0.0) : 0.0;
      damped_of[k] = damped_of[k] || added > 0.0, damped = damped || added > 0.0;
      set_lane(d2[mode], k, lane(own[mode], k) + added),
          set_lane(lag[mode], k, added > 0.0 ? added / square : 0.0);
    }
  }

 private:
  Block<Real> memory;
  Real *seen;  // (stride) the configuration looked at last
  double patience[LANES],
      gone[LANES];  // way to the next look; from where the modes were taken to the last one
  // Scratch of `take`: (n, n), but for squares (n).
  std::vector<double> M, K, D, old, half, turned_M, turned_K, shapes, momenta, lost, squares;

  std::size_t at(int i, int j) const { return std::size_t(i) * std::size_t(n) + std::size_t(j); }

  // (94): Frobenius' norm of Phi A Phi^T less what it was, relative to scale_i scale_j: the larger
  // one of A = M and A = K.
  double change(int k, const std::vector<double> &turned_M, const std::vector<double> &turned_K,
                double slow) const {
    double inertia = 0.0, stiffness = 0.0;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        const double same = a == b, twice = a == b ? 1.0 : 2.0, wa = lane(w2[a], k),
                     wb = lane(w2[b], k);
        const double heavier = turned_M[at(a, b)] - same, stiffer = turned_K[at(a, b)] - same * wa;
        inertia += twice * heavier * heavier;
        stiffness +=
            twice * stiffer * stiffer / (larger(wa, slow * slow) * larger(wb, slow * slow));
      }
    return root(larger(inertia, stiffness));
  }
};

}  // namespace flexura
