// The lowest modes of a robot with many unknowns, without a matrix of that size: Lanczos' method (J. Res.
// Nat. Bur. Stand. 45 (1950) 255).
//
// T = (K + s M)^-1 M is symmetric in the inner product x . M y; its largest eigenvalues mu = 1/(w^2 + s) are
// the lowest frequencies. A basis Q, Q^T M Q = 1, grows by T times each of its vectors, made orthogonal to
// all that are there; H = Q^T M T Q is small.
#include <algorithm>
#include <cmath>

#include "eigen.hpp"
#include "spectrum.hpp"

namespace flexura {
namespace {

using Numbers = std::vector<double>;
constexpr int FIRST = 4;  // vectors to begin with: equal frequencies of equal links come several at a time
constexpr double ENOUGH = 1e-9;  // residual of a mode beside its mu; the error of mu is its square
constexpr double NOTHING = 1e-10;

double inner(const Numbers &a, const Numbers &b) {
  double sum[4] = {0.0, 0.0, 0.0, 0.0};  // four, so that none waits for the one before
  for (std::size_t k = 0; k < a.size(); ++k) sum[k % 4] += a[k] * b[k];
  return together(sum);
}

class Krylov {
 public:
  std::vector<Numbers> Q, MQ, H;  // H[j]: Q^T M T q_j, as far as the basis went when T q_j joined it

  Krylov(const Model<double> &model, const double *q, const std::vector<int> &rows)
      : model_(model), work_(model), q_(q, q + model.n), zero_(model.n, 0.0), rows_(rows) {}

  Numbers mass_times(const Numbers &x) {
    Numbers all(model_.n), out(model_.n, 0.0);
    forces(model_, work_, q_.data(), zero_.data(), x.data(), Terms{false, false, false}, all.data());
    for (int k : rows_) out[k] = all[k];
    return out;
  }

  // Joins what x has beside the basis; returns the products of x with the basis before and the vector that
  // joined, if any.
  Numbers join(Numbers x) {
    Numbers products(Q.size(), 0.0);
    double before = 0.0;  // x . M x, as far as it lies in the basis
    for (int twice = 0; twice < 2; ++twice)
      for (std::size_t j = 0; j < Q.size(); ++j) {
        const double part = inner(MQ[j], x);
        products[j] += part, before += part * part;
        for (std::size_t k = 0; k < x.size(); ++k) x[k] -= part * Q[j][k];
      }
    Numbers Mx = mass_times(x);
    const double square = inner(x, Mx), length = std::sqrt(std::max(square, 0.0));
    if (!(square > NOTHING * NOTHING * before)) return products;
    for (double &value : x) value /= length;
    for (double &value : Mx) value /= length;
    Q.push_back(std::move(x)), MQ.push_back(std::move(Mx));
    products.push_back(length);
    return products;
  }

  // A vector of numbers that look random and are the same everywhere, smoothed by T.
  Numbers start(const Still &still) {
    Numbers x(model_.n, 0.0), out(model_.n);
    for (int k : rows_) {
      seed_ = seed_ * 6364136223846793005u + 1442695040888963407u;
      x[k] = double(seed_ >> 11) * 0x1p-53 - 0.5;
    }
    still.solve(mass_times(x).data(), out.data());
    return out;
  }

 private:
  const Model<double> &model_;
  Workspace<double> work_;
  Numbers q_, zero_;
  std::vector<int> rows_;
  std::uint64_t seed_ = 1;
};

// w^2 of a shape near the lowest one: every piece bends as under a moment at its end.
double estimate(const Model<double> &model, Still &still, Krylov &krylov, const double *q) {
  Numbers z(model.n, 0.0), bent(q, q + model.n), slope(model.n);
  for (const Piece<double> &c : model.pieces)
    for (int k = 0; k < c.m; ++k)
      if (c.joint != At::sleeve)
        z[c.own() + k] = c.tip_angle[k] / c.K[k];
      else if (k == 0)
        z[c.own()] = q[c.first] / matter_at(c, c.length).stiffness;
  for (int k = 0; k < model.n; ++k) bent[k] = z[k];
  still.gradient(bent.data(), TipLoad{}, 0.0, slope.data());
  const double inertia = inner(z, krylov.mass_times(z));
  return inertia > 0.0 ? inner(z, slope) / inertia : 1.0;
}

struct Ritz {
  Numbers mu, vectors;  // mu ascending; vectors (size, size) by columns
  int good = 0;         // how many of the largest have converged
};

Ritz project(const Krylov &krylov, int most) {
  const int size = int(krylov.H.size());
  Ritz out;
  out.mu.resize(size), out.vectors.resize(size * size);
  Numbers H(size * size, 0.0);
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size && i < int(krylov.H[j].size()); ++i)
      H[i * size + j] = H[j * size + i] = krylov.H[j][i];
  eigen_symmetric(size, H.data(), out.mu.data(), out.vectors.data());
  for (int k = size - 1; k >= 0 && out.good < most; --k, ++out.good) {
    double outside = 0.0;  // T x has this beside the basis that H is of
    for (int i = size; i < int(krylov.Q.size()); ++i) {
      double part = 0.0;
      for (int j = 0; j < size; ++j)
        if (i < int(krylov.H[j].size())) part += krylov.H[j][i] * out.vectors[j * size + k];
      outside += part * part;
    }
    if (std::sqrt(outside) > ENOUGH * std::fabs(out.mu[k]) + 0x1p-48 * std::fabs(out.mu[size - 1])) break;
  }
  return out;
}

}  // namespace

Modes lowest_modes(const Model<double> &model, const double *q, const char *free, int most,
                   const TipLoad &load) {
  const std::vector<int> rows = moving_rows(model, free);
  const int n = model.n, moving = int(rows.size());
  Still still(model, q, free);
  Krylov krylov(model, q, rows);
  const double near = estimate(model, still, krylov, q);
  double size,
      shift = moving > n - model.links() ? near : 0.0;  // free joints may have nothing that holds them
  still.energy(q, load, 1.0, size);
  for (int tries = 0; still.tangent(load, 1.0, shift, false) > 0 && tries < 60; ++tries)
    shift = std::max(near, 16.0 * shift);
  for (int k = 0; k < FIRST; ++k) krylov.join(krylov.start(still));

  Ritz ritz;
  Numbers next(n);
  int check = most + most / 2 + 8;
  for (bool complete = false; !complete;) {
    const std::size_t j = krylov.H.size();
    if (j < krylov.Q.size()) {
      still.solve(krylov.MQ[j].data(), next.data());
      krylov.H.push_back(krylov.join(next));
      if (int(j) + 1 < check && j + 1 < krylov.Q.size()) continue;
      check += 4 + check / 8;
    }
    ritz = project(krylov, most);
    if (krylov.Q.empty()) return Modes{};  // nothing has mass
    const int size_now = int(krylov.H.size()), found = std::min(most, size_now);
    const bool closed = krylov.H.size() == krylov.Q.size();
    if (ritz.good < found && !closed) continue;
    // is any below the last? Counted halfway to the next square, or just above if there is none
    const double last = 1.0 / ritz.mu[size_now - found] - shift;
    const double above = found < size_now ? 1.0 / ritz.mu[size_now - found - 1] - shift : HUGE_VAL;
    const double gap = 1e-6 * (std::fabs(last) + shift),
                 x = last + std::min(std::max(0.5 * (above - last), gap), 1e-2 * (std::fabs(last) + near));
    int below = 0;
    for (double mu : ritz.mu) below += 1.0 / mu - shift < x && mu > 0.0;
    const int really = still.tangent(load, 1.0, -x, false);
    complete = really <= below || size_now >= moving;
    still.tangent(load, 1.0, shift, false);
    if (!complete) {
      const std::size_t before = krylov.Q.size();
      krylov.join(krylov.start(still));
      complete = krylov.Q.size() == before && closed;  // nothing more has mass
    }
  }
  Modes out;
  const int size_now = int(krylov.H.size());
  for (int k = size_now - 1; k >= 0 && out.count < most && ritz.mu[k] > 0.0; --k, ++out.count)
    out.squares.push_back(1.0 / ritz.mu[k] - shift);
  out.shapes.assign(n * out.count, 0.0);
  for (int k = 0; k < out.count; ++k) {
    Numbers x(n, 0.0);
    for (int j = 0; j < size_now; ++j)
      for (int i : rows) x[i] += krylov.Q[j][i] * ritz.vectors[j * size_now + size_now - 1 - k];
    double largest = 0.0;
    for (double value : x)
      if (std::fabs(value) > std::fabs(largest)) largest = value;
    for (int i = 0; i < n; ++i) out.shapes[i * out.count + k] = largest < 0.0 ? -x[i] : x[i];
  }
  return out;
}

}  // namespace flexura
