// Matrices by composite bodies and dual numbers, and the modes from them (natural_modes.hpp).
#include "statics_and_modes/natural_modes.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/mass_matrix.hpp"
#include "link/assembly.hpp"
#include "numbers/eigenproblem.hpp"

namespace flexura {
namespace {

using Numbers = std::vector<double>;
constexpr int MANY = 80;  // unknowns from which on a few modes are not taken from the matrices

// Columns k ... k + 3 of the derivatives of the forces at (q, v) and the load, by the rows of `by`
// (of q or v), for all k.
template <class Set>
void differentiate(const Model<double> &model, const double *q, const double *v,
                   const TipLoad &load, const Terms &terms, double *out, Set set) {
  const int n = model.n;
  const Model<Dual<4>> moved = dual(model);
  Workspace<Dual<4>> work(moved);
  std::vector<Dual<4>> y(n), rate(n), none(n, Dual<4>(0.0)), force(n), tip(n);
  for (int k = 0; k < n; ++k) y[k] = q[k], rate[k] = v ? v[k] : 0.0;
  for (int first = 0; first < n; first += 4) {
    for (int k = first; k < std::min(first + 4, n); ++k) set(y, rate, k).d.set(k - first, 1.0);
    forces(moved, work, y.data(), rate.data(), none.data(), terms, force.data());
    std::fill(tip.begin(), tip.end(), Dual<4>(0.0));
    add_tip_load(moved, work, load, tip.data());
    for (int k = first; k < std::min(first + 4, n); ++k) {
      for (int i = 0; i < n; ++i) out[i * n + k] = force[i].d[k - first] - tip[i].d[k - first];
      set(y, rate, k).d = Pack<4>(0.0);
    }
  }
}

// Rows and columns `rows` of A (n, n).
Numbers picked(const Numbers &A, int n, const std::vector<int> &rows) {
  Numbers out;
  for (int i : rows)
    for (int j : rows) out.push_back(A[i * n + j]);
  return out;
}

bool only_revolute(const Model<double> &model, const char *free) {
  for (int i = 0; free && i < model.links(); ++i)
    if (free[i] && model.kind[i] != JointKind::revolute) return false;
  return true;
}

}  // namespace

void mass_matrix(const Model<double> &model, const double *q, double *M) {
  Workspace<double> work(model);
  const Numbers zero(std::size_t(model.n), 0.0);
  std::vector<Vec3<double>> wrench(zero.size());
  mass_matrix(model, work, q, zero.data(), wrench.data(), M);
}

void stiffness_matrix(const Model<double> &model, const double *q, const double *v,
                      const TipLoad &load, double *K) {
  differentiate(model, q, v, load, Terms{true, true, v != nullptr}, K,
                [](auto &y, auto &, int k) -> Dual<4> & { return y[k]; });
}

void rate_matrix(const Model<double> &model, const double *q, const double *v, double *D) {
  differentiate(model, q, v, TipLoad{}, Terms{true, true, true}, D,
                [](auto &, auto &rate, int k) -> Dual<4> & { return rate[k]; });
}

std::vector<int> moving_rows(const Model<double> &model, const char *free) {
  std::vector<char> moves(model.n, 1);
  for (int i = 0; i < model.links(); ++i) moves[model.first[i]] = free != nullptr && free[i] != 0;
  std::vector<int> rows;
  for (int k = 0; k < model.n; ++k)
    if (moves[k]) rows.push_back(k);
  return rows;
}

std::vector<double> NaturalModes::frequencies() const {
  std::vector<double> out;
  for (double square : squares)
    out.push_back(std::sqrt(std::max(square, 0.0)) / 6.28318530717958647692);
  return out;
}

NaturalModes natural_modes(const Model<double> &model, const double *q, const char *free, int most,
                           const TipLoad &load, bool shapes) {
  const int n = model.n;
  const std::vector<int> rows = moving_rows(model, free);
  const int moving = int(rows.size());
  if (most > 0 && moving >= MANY && 4 * most < moving && only_revolute(model, free))
    return lowest_modes(model, q, free, most, load, shapes);
  Numbers M(n * n), K(n * n);
  mass_matrix(model, q, M.data());
  stiffness_matrix(model, q, nullptr, load, K.data());
  M = picked(M, n, rows), K = picked(K, n, rows);
  for (int i = 0; i < moving; ++i)
    for (int j = 0; j < i; ++j)
      K[i * moving + j] = K[j * moving + i] = 0.5 * (K[i * moving + j] + K[j * moving + i]);
  Numbers squares(moving), vectors(moving * moving);
  const int finite = eigen_pencil(moving, K.data(), M.data(), squares.data(), vectors.data());
  NaturalModes out;
  out.count = most > 0 ? std::min(most, finite) : finite;
  out.squares.assign(squares.begin(), squares.begin() + out.count);
  if (!shapes) return out;
  out.shapes.assign(n * out.count, 0.0);
  for (int i = 0; i < moving; ++i)
    for (int k = 0; k < out.count; ++k)
      out.shapes[rows[i] * out.count + k] = vectors[i * moving + k];
  return out;
}

}  // namespace flexura
