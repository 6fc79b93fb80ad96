#include "control/predicted_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "statics_and_modes/natural_modes.hpp"

namespace flexura {
namespace {

// C (n, columns) += s A (n, m) B (m, columns), row by row.
void add_product(const double *A, const double *B, double *C, int n, int m, int columns, double s) {
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < m; ++k) {
      const double factor = s * A[i * m + k];
      if (factor == 0.0) continue;
      const double *from = B + k * columns;
      double *to = C + i * columns;
      for (int j = 0; j < columns; ++j) to[j] += factor * from[j];
    }
}

// to (columns) += sum of factors (rows) times rows of `from`, each `stride` numbers after the
// other.
void add_rows(const double *factors, const double *from, double *to, int rows, int stride,
              int columns) {
  int l = 0;
  for (; l + 4 <= rows; l += 4) {  // a sum in memory is read and written for four of them
    const double *a = from + l * stride, *b = a + stride, *c = b + stride, *d = c + stride;
    const double p = factors[l], q = factors[l + 1], r = factors[l + 2], s = factors[l + 3];
    for (int j = 0; j < columns; ++j) to[j] = to[j] + p * a[j] + q * b[j] + r * c[j] + s * d[j];
  }
  for (; l < rows; ++l) {
    const double *a = from + l * stride;
    for (int j = 0; j < columns; ++j) to[j] += factors[l] * a[j];
  }
}

}  // namespace

void eliminate_dense(std::vector<double> &A, std::vector<double> &B, int n, int columns) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(A[i * n + k]) > std::abs(A[pivot * n + k])) pivot = i;
    if (pivot != k) {
      std::swap_ranges(A.begin() + k * n, A.begin() + (k + 1) * n, A.begin() + pivot * n);
      std::swap_ranges(B.begin() + k * columns, B.begin() + (k + 1) * columns,
                       B.begin() + pivot * columns);
    }
    const double inverse = 1.0 / A[k * n + k];
    for (int i = k + 1; i < n; ++i) {
      const double factor = A[i * n + k] * inverse;
      if (factor == 0.0) continue;
      for (int j = k + 1; j < n; ++j) A[i * n + j] -= factor * A[k * n + j];
      for (int j = 0; j < columns; ++j) B[i * columns + j] -= factor * B[k * columns + j];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    for (int i = k + 1; i < n; ++i) {
      const double factor = A[k * n + i];
      for (int j = 0; j < columns; ++j) B[k * columns + j] -= factor * B[i * columns + j];
    }
    const double inverse = 1.0 / A[k * n + k];
    for (int j = 0; j < columns; ++j) B[k * columns + j] *= inverse;
  }
}

PredictedMotion::PredictedMotion(std::shared_ptr<const Model<double>> model, std::vector<int> free,
                                 std::vector<int> driven)
    : model_(std::move(model)),
      derivatives_(*model_),
      free_(std::move(free)),
      driven_(std::move(driven)),
      q_(std::size_t(model_->n)),
      v_(q_.size()),
      a_(q_.size()),
      force_(q_.size()),
      by_position_(q_.size() * q_.size()),
      by_rate_(by_position_.size()),
      mass_(by_position_.size()),
      tip_(2),
      tip_by_position_(2 * q_.size()) {}

void PredictedMotion::step(const double *x, const double *u, double *a, double h, double *R,
                           double *G, double *d) {
  const int m = int(free_.size()), n = 2 * m, p = inputs(), all = model_->n;
  for (int i = 0; i < m; ++i) q_[free_[i]] = x[i], v_[free_[i]] = x[m + i], a_[free_[i]] = a[i];
  derivatives_.at(q_.data(), v_.data(), a_.data(), force_.data(), by_position_.data(),
                  by_rate_.data(), tip_.data(), tip_by_position_.data());
  mass_matrix(*model_, q_.data(), mass_.data());

  // M^-1 (F_q, F_v, F - E u, E)
  const int wide = n + 1 + p;
  reduced_.assign(m * m, 0.0), right_.assign(m * wide, 0.0);
  for (int i = 0; i < m; ++i) {
    for (int k = 0; k < m; ++k) {
      const int at = free_[i] * all + free_[k];
      reduced_[i * m + k] = mass_[at];
      right_[i * wide + k] = by_position_[at], right_[i * wide + m + k] = by_rate_[at];
    }
    right_[i * wide + n] = force_[free_[i]];
  }
  for (int j = 0; j < p; ++j) {
    right_[driven_[j] * wide + n] -= u[j];
    right_[driven_[j] * wide + n + 1 + j] = 1.0;
  }
  eliminate_dense(reduced_, right_, m, wide);
  for (int i = 0; i < m; ++i) a[i] -= right_[i * wide + n];

  // Z = h A, D = 1 - 2/3 Z + Z^2 / 6; held = h (B, f)
  const int columns = p + 1, every = n + columns;
  Z_.assign(n * n, 0.0), held_.assign(n * columns, 0.0);
  for (int i = 0; i < m; ++i) {
    Z_[i * n + m + i] = h;
    for (int k = 0; k < n; ++k) Z_[(m + i) * n + k] = -h * right_[i * wide + k];
    for (int j = 0; j < p; ++j) held_[(m + i) * columns + j] = h * right_[i * wide + n + 1 + j];
    held_[i * columns + p] = h * x[m + i], held_[(m + i) * columns + p] = h * a[i];
  }
  D_.assign(n * n, 0.0), right_.assign(n * every, 0.0);
  add_product(Z_.data(), Z_.data(), D_.data(), n, n, n, 1.0 / 6);
  std::vector<double> &right = right_;
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      D_[i * n + k] -= 2.0 / 3 * Z_[i * n + k];
      right[i * every + k] = Z_[i * n + k] / 3;
    }
    D_[i * n + i] += 1.0, right[i * every + i] += 1.0;
    for (int j = 0; j < columns; ++j) {
      double value = held_[i * columns + j];
      for (int k = 0; k < n; ++k) value -= Z_[i * n + k] * held_[k * columns + j] / 6;
      right[i * every + n + j] = value;
    }
  }
  eliminate_dense(D_, right, n, every);
  for (int i = 0; i < n; ++i) {
    d[i] = x[i] + right[i * every + n + p];
    for (int k = 0; k < n; ++k) R[i * n + k] = right[i * every + k], d[i] -= R[i * n + k] * x[k];
    for (int j = 0; j < p; ++j)
      G[i * p + j] = right[i * every + n + j], d[i] -= G[i * p + j] * u[j];
  }
}

CondensedProgram condense(const TickProgram &s) {
  const int V = s.N * s.inputs, n = s.n;
  CondensedProgram out;
  out.H.assign(V * V, 0.0), out.A.assign(s.N * s.rows * V, 0.0);
  out.by_force.assign(s.N * n * V, 0.0);
  std::vector<double> weighted;
  for (int k = 0; k < s.N; ++k) {
    double *now = out.by_force.data() + k * n * V;
    const double *R = s.R + k * n * n;
    const int used = k * s.inputs;  // columns that are not 0 before this interval
    const int columns = used + s.inputs;
    for (int i = 0; i < n; ++i) {
      if (k > 0) add_rows(R + i * n, now - n * V, now + i * V, n, V, used);
      for (int j = 0; j < s.inputs; ++j) now[i * V + used + j] = s.G[(k * n + i) * s.inputs + j];
    }
    auto pay = [&](const double *W, int outputs) {
      weighted.assign(outputs * columns, 0.0);
      for (int o = 0; o < outputs; ++o) {
        double *row = weighted.data() + o * columns;
        add_rows(W + o * n, now, row, n, V, columns);
        for (int i = 0; i < columns; ++i)
          for (int j = 0; j <= i; ++j) out.H[i * V + j] += row[i] * row[j];
      }
    };
    pay(s.W + k * s.outputs * n, s.outputs);
    if (k + 1 == s.N) pay(s.end, n);
    for (int r = 0; r < s.rows; ++r) {
      double *row = out.A.data() + (k * s.rows + r) * V;
      for (int i = 0; i < n; ++i) {
        const double factor = s.limited[r * n + i];
        if (factor == 0.0) continue;
        for (int j = 0; j < columns; ++j) row[j] += factor * now[i * V + j];
      }
    }
  }
  for (int i = 0; i < V; ++i)
    for (int j = i + 1; j < V; ++j) out.H[i * V + j] = out.H[j * V + i];
  return out;
}

TickVectors renew(const TickProgram &s, const double *by_force, const double *start,
                  const double *u, const double *wanted) {
  const int V = s.N * s.inputs, n = s.n;
  TickVectors out;
  out.x.assign(s.N * n, 0.0), out.g.assign(V, 0.0), out.at.assign(s.N * s.rows, 0.0);
  std::vector<double> off(n), price(n);
  for (int k = 0; k < s.N; ++k) {
    double *now = out.x.data() + k * n;
    const double *before = k ? now - n : start;
    for (int i = 0; i < n; ++i) {
      now[i] = s.d[k * n + i];
      for (int l = 0; l < n; ++l) now[i] += s.R[(k * n + i) * n + l] * before[l];
      for (int j = 0; j < s.inputs; ++j)
        now[i] += s.G[(k * n + i) * s.inputs + j] * u[k * s.inputs + j];
      off[i] = now[i] - wanted[k * n + i];
    }
    std::fill(price.begin(), price.end(), 0.0);
    auto pay = [&](const double *W, int outputs) {
      for (int o = 0; o < outputs; ++o) {
        double shown = 0.0;
        for (int i = 0; i < n; ++i) shown += W[o * n + i] * off[i];
        for (int i = 0; i < n; ++i) price[i] += W[o * n + i] * shown;
      }
    };
    pay(s.W + k * s.outputs * n, s.outputs);
    if (k + 1 == s.N) pay(s.end, n);
    for (int i = 0; i < n; ++i) {
      const double *row = by_force + (k * n + i) * V;
      for (int j = 0; j < (k + 1) * s.inputs; ++j) out.g[j] += price[i] * row[j];
    }
    for (int r = 0; r < s.rows; ++r)
      for (int i = 0; i < n; ++i) out.at[k * s.rows + r] += s.limited[r * n + i] * now[i];
  }
  return out;
}

}  // namespace flexura
