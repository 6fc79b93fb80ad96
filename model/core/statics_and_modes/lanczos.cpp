// The lowest modes of a robot with many unknowns, without a matrix of that size: Lanczos' method
// (55) (J. Res. Nat. Bur. Stand. 45 (1950) 255).
//
// T = (K + s M)^-1 M is symmetric in the inner product x . M y; its largest eigenvalues mu = 1/(w^2
// + s) are the lowest frequencies. A basis Q, Q^T M Q = 1, grows by T times its last vector, made
// orthogonal to all that are there: Q^T M T Q has three diagonals. Modes that are known stand in
// front of it.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "numbers/eigenproblem.hpp"
#include "statics_and_modes/natural_modes.hpp"

namespace flexura {
namespace {

using Numbers = std::vector<double>;
constexpr double ENOUGH = 1e-9;  // residual of a mode beside its mu; the error of mu is its square
constexpr double NOTHING = 1e-10;      // of a vector, beside what it was
constexpr double ROUND_OFF = 0x1p-48;  // of T, beside its largest mu

double inner(const Numbers &a, const Numbers &b) {
  double sum[4] = {0.0, 0.0, 0.0, 0.0};  // four, so that none waits for the one before
  for (std::size_t i = 0; i < a.size(); i += 4)
    for (int l = 0; l < 4; ++l) sum[l] += a[i + l] * b[i + l];
  return together(sum);
}

// Vectors x and M x by rows, x . M y = 0 or 1. Rows are padded to fours and come in fours; what is
// not used is zero.
class Basis {
 public:
  explicit Basis(int n) : wide(padded(n)) {}

  const int wide;
  int count = 0;
  const double *row(int k) const { return &rows_[k * wide]; }
  const double *mass_row(int k) const { return &mass_rows_[k * wide]; }

  // Takes off x what lies in the basis; returns how much of the last vector.
  double take_off(Numbers &x) const {
    using Chunk = Row<double, 4>;
    double last = 0.0;
    for (int k = 0; k < count; k += 4) {
      const double *a = mass_row(k), *b = a + wide, *c = b + wide, *d = c + wide;
      Pack<4> sums[4] = {0.0, 0.0, 0.0, 0.0};
      for (int i = 0; i < wide; i += 4) {
        const Pack<4> here = Chunk::load(&x[i], 0);
        sums[0] += Chunk::load(a + i, 0) * here, sums[1] += Chunk::load(b + i, 0) * here;
        sums[2] += Chunk::load(c + i, 0) * here, sums[3] += Chunk::load(d + i, 0) * here;
      }
      double part[4];
      for (int l = 0; l < 4; ++l) part[l] = (sums[l][0] + sums[l][1]) + (sums[l][2] + sums[l][3]);
      a = row(k), b = a + wide, c = b + wide, d = c + wide;
      for (int i = 0; i < wide; ++i)
        x[i] -= (part[0] * a[i] + part[1] * b[i]) + (part[2] * c[i] + part[3] * d[i]);
      if (count - k <= 4) last = part[count - 1 - k];
    }
    return last;
  }

  void join(const Numbers &x, const Numbers &Mx, double length) {
    if (count % 4 == 0)
      for (Numbers *rows : {&rows_, &mass_rows_}) rows->resize((count + 4) * wide, 0.0);
    for (int i = 0; i < wide; ++i)
      rows_[count * wide + i] = x[i] / length, mass_rows_[count * wide + i] = Mx[i] / length;
    ++count;
  }

  // Forgets all but the first vectors.
  void keep(int first) {
    for (Numbers *rows : {&rows_, &mass_rows_})
      std::fill(rows->begin() + first * wide, rows->end(), 0.0), rows->resize(padded(first) * wide);
    count = first;
  }

 private:
  Numbers rows_, mass_rows_;
};

class Lanczos {
 public:
  Numbers known;                                // w^2 of the vectors in front of the basis
  std::vector<std::pair<double, double>> ritz;  // of the last run: mu, descending, and residual
  int good = 0;                                 // how many of these have converged

  Lanczos(ChainAtRest &still, int n, const std::vector<int> &rows, double shift)
      : still_(still), rows_(rows), shift_(shift), basis_(n), x_(basis_.wide), Mx_(basis_.wide) {}

  // w^2 of the known modes, and of the first `count` of the last run.
  Numbers squares(int count) const {
    Numbers out = known;
    for (int k = 0; k < count; ++k) out.push_back(1.0 / ritz[k].first - shift_);
    return out;
  }

  const double *shape(int k) const { return basis_.row(k); }  // of a known mode

  // Adds the motion of a free joint that nothing holds to the known modes: w = 0.
  void add_joint(int row) {
    std::fill(x_.begin(), x_.end(), 0.0);
    x_[row] = 1.0;
    if (join_rest()) known.push_back(0.0);
  }

  // Lanczos' method from a new vector, until `want` modes have converged or the basis is complete;
  // false: none has.
  bool run(int want) {
    begin_ = basis_.count, good = 0;
    ritz.clear(), diagonal_.clear(), beside_.clear();
    std::fill(x_.begin(), x_.end(), 0.0);
    for (int k : rows_) {  // numbers that look random and are the same everywhere
      seed_ = seed_ * 6364136223846793005u + 1442695040888963407u;
      x_[k] = double(seed_ >> 11) * 0x1p-53 - 0.5;
    }
    still_.mass_times(x_.data(), Mx_.data());
    still_.solve(Mx_.data(), x_.data());
    if (!join_rest()) return false;
    double largest = 0.0, left;
    for (int check = want + want / 2 + 4;; basis_.join(x_, Mx_, left)) {
      still_.solve(basis_.mass_row(basis_.count - 1), x_.data());
      diagonal_.push_back(basis_.take_off(x_));
      diagonal_.back() += basis_.take_off(x_);  // once is not enough: M is badly conditioned
      largest = std::max(largest, diagonal_.back());
      left = length(), beside_.push_back(left);
      const bool closed = !(left > ROUND_OFF * largest) || basis_.count >= int(rows_.size());
      if (!closed && int(diagonal_.size()) < check) continue;
      check += 2;
      project();
      if (closed || good >= want) return good > 0;
    }
  }

  // Adds the modes that have converged to the known ones.
  void add_converged() {
    const int size = int(diagonal_.size()), wide = basis_.wide;
    Numbers values, Q(size * size, 0.0), vectors(good * wide, 0.0);
    for (int k = 0; k < size; ++k)
      Q[k * size + size - 1 - k] = 1.0;  // columns in the order of the basis
    const std::vector<int> order = diagonalise(values, size, Q);
    for (int k = 0; k < good; ++k) {
      double *x = &vectors[k * wide];
      for (int j = 0; j < size; ++j) {
        const double part = Q[order[k] * size + j], *q = basis_.row(begin_ + j);
        for (int i = 0; i < wide; ++i) x[i] += part * q[i];
      }
      known.push_back(1.0 / values[order[k]] - shift_);
    }
    basis_.keep(begin_);
    for (int k = 0; k < good; ++k) {
      std::copy_n(&vectors[k * wide], wide, x_.begin());
      basis_.join(x_, Mx_, length());
    }
    good = 0, ritz.clear();
  }

 private:
  // The square root of x . M x; M x goes into Mx_.
  double length() {
    still_.mass_times(x_.data(), Mx_.data());
    return std::sqrt(std::max(inner(x_, Mx_), 0.0));
  }

  // Adds what x has beside the basis to the basis, if that is more than round-off.
  bool join_rest() {
    const double before = length();
    basis_.take_off(x_), basis_.take_off(x_);
    const double left = length();
    if (left > NOTHING * before) basis_.join(x_, Mx_, left);
    return left > NOTHING * before;
  }

  // Eigenvalues of Q^T M T Q, its rows from the last to the first, for they ascend that way; gives
  // their indices by descending value. The rows of Q (size, width) turn as in eigen_tridiagonal.
  std::vector<int> diagonalise(Numbers &values, int width, Numbers &Q) const {
    const int size = int(diagonal_.size());
    values.assign(diagonal_.rbegin(), diagonal_.rend());
    Numbers off(beside_.rbegin() + 1, beside_.rend());
    off.push_back(0.0);
    eigen_tridiagonal(size, values.data(), off.data(), width, Q.data());
    std::vector<int> order(size);
    std::iota(order.begin(), order.end(), 0);
    for (double &value : values)
      if (!(value == value)) value = -HUGE_VAL;  // what is not a number comes last
    std::sort(order.begin(), order.end(), [&](int a, int b) { return values[a] > values[b]; });
    return order;
  }

  // Finds `ritz` and `good`.
  void project() {
    Numbers values,
        last(diagonal_.size(), 0.0);  // of each vector the part along the last of the basis
    last[0] = 1.0;
    ritz.clear(), good = 0;
    for (int k : diagonalise(values, 1, last))
      if (values[k] > 0.0) ritz.emplace_back(values[k], std::fabs(last[k]) * beside_.back());
    if (ritz.empty()) return;
    const double least = ROUND_OFF * ritz[0].first;
    while (good < int(ritz.size()) && ritz[good].first > least &&
           ritz[good].second <= ENOUGH * ritz[good].first + least)
      ++good;
  }

  ChainAtRest &still_;
  const std::vector<int> &rows_;
  const double shift_;
  Basis basis_;
  Numbers x_, Mx_, diagonal_, beside_;  // the last two: of Q^T M T Q
  int begin_ = 0;                       // first vector of this run
  std::uint64_t seed_ = 1;
};

// How many modes below the last of `most` are not among those found: by the pivots of K - x M, x
// halfway to the next square, or just above the last if there is none.
int missing(const Lanczos &search, ChainAtRest &still, const TipLoad &load, int most, double near) {
  Numbers squares = search.squares(int(search.ritz.size()));
  std::sort(squares.begin(), squares.end());
  const int found = std::min(most, int(search.known.size()) + search.good);
  const double last = squares[found - 1],
               above = found < int(squares.size()) ? squares[found] : HUGE_VAL;
  const double gap = 1e-6 * (std::fabs(last) + near);
  const double x =
      last + std::min(std::max(0.5 * (above - last), gap), 1e-2 * (std::fabs(last) + near));
  const auto below = std::lower_bound(squares.begin(), squares.end(), x) - squares.begin();
  return still.tangent(load, 1.0, -x, false) - int(below);
}

}  // namespace

NaturalModes lowest_modes(const Model<double> &model, const double *q, const char *free, int most,
                          const TipLoad &load, bool shapes) {
  const std::vector<int> rows = moving_rows(model, free);
  const int n = model.n;
  ChainAtRest still(model, q, free);
  double size;
  still.energy(q, load, 1.0, size);
  const bool turns =
      int(rows.size()) > n - model.links();  // free joints may have nothing that holds them
  const double near = still.near_lowest();
  double shift = turns ? 0x1p-8 * near : 0.0;
  for (int tries = 0; still.tangent(load, 1.0, shift, false) > 0;
       shift = std::max(near, 16.0 * shift))
    if (++tries > 60) return NaturalModes{};
  Lanczos search(still, n, rows, shift);
  if (still.idle(load))
    for (int i = 0; free && i < model.links(); ++i)
      if (free[i]) search.add_joint(model.first[i]);
  for (int want = most - int(search.known.size()); want > 0 && search.run(want);) {
    want = missing(search, still, load, most, near);
    if (want > 0) still.tangent(load, 1.0, shift, false);
    if (want > 0 || shapes) search.add_converged();
  }
  const Numbers found = search.squares(search.good);
  std::vector<int> order(found.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return found[a] < found[b]; });
  NaturalModes out;
  out.count = std::min(most, int(found.size()));
  for (int k = 0; k < out.count; ++k) out.squares.push_back(found[order[k]]);
  if (!shapes) return out;
  out.shapes.assign(n * out.count, 0.0);
  for (int k = 0; k < out.count; ++k) {
    const double *x = search.shape(order[k]);
    double largest = 0.0;
    for (int i = 0; i < n; ++i)
      if (std::fabs(x[i]) > std::fabs(largest)) largest = x[i];
    for (int i = 0; i < n; ++i) out.shapes[i * out.count + k] = largest < 0.0 ? -x[i] : x[i];
  }
  return out;
}

}  // namespace flexura
