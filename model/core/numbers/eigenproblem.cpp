// The symmetric eigenproblem.
#include "numbers/eigenproblem.hpp"

#include <algorithm>
#include <numeric>

namespace flexura {

namespace {

using Numbers = std::vector<double>;
constexpr double epsilon = 0x1p-52;

std::size_t sized(int n) { return static_cast<std::size_t>(n); }

// Householder's reduction of A (n, n), symmetric and full, from the last row up: A = Q T Q^T with T
// tridiagonal, `diagonal` (n) and `off` (n), off[k] between k and k + 1. A becomes Q^T: row k is
// the k-th column of Q.
void reduce(int n, double *A, double *diagonal, double *off) {
  Numbers half(sized(n), 0.0), push(sized(n));
  for (int i = n - 1; i > 0; --i) {
    double *u = A + i * n;
    double square = 0.0, largest = 0.0;
    for (int k = 0; k < i; ++k) largest = std::max(largest, std::fabs(u[k]));
    if (i == 1 || largest == 0.0) {  // nothing to reflect
      off[i - 1] = u[i - 1];
      continue;
    }
    for (int k = 0; k < i; ++k) square += (u[k] / largest) * (u[k] / largest);
    const double length = largest * std::sqrt(square), last = u[i - 1],
                 turned = last > 0.0 ? -length : length;
    off[i - 1] = turned;
    u[i - 1] = last - turned;
    const double h = -turned * u[i - 1];  // u . u / 2
    half[i] = h;
    double along = 0.0;
    for (int j = 0; j < i; ++j) {  // push = A u / h - u (u . A u) / (2 h^2)
      double sum = 0.0;
      for (int k = 0; k < i; ++k) sum += A[j * n + k] * u[k];
      push[j] = sum / h;
      along += push[j] * u[j];
    }
    for (int j = 0; j < i; ++j) push[j] -= along / (2.0 * h) * u[j];
    for (int j = 0; j < i; ++j) {
      const double a = u[j], b = push[j];
      double *row = A + j * n;
      for (int k = 0; k < i; ++k) row[k] -= a * push[k] + b * u[k];
    }
  }
  for (int i = 0; i < n; ++i) diagonal[i] = A[i * n + i];
  // Q = P_{n-1} ... P_2: a reflection changes what the smaller ones have built before it. Rows of
  // Q^T are built in place.
  Numbers u(sized(n)), g(sized(n));
  for (int i = 0; i < n; ++i) {
    double *row = A + i * n;
    std::copy(row, row + i, u.begin());
    std::fill(row, row + i, 0.0);
    row[i] = 1.0;
    for (int j = 0; j < i; ++j) A[j * n + i] = 0.0;
    if (half[i] == 0.0) continue;
    for (int j = 0; j < i; ++j) {  // row j of Q^T: Q^T (1 - u u^T / h)
      double *q = A + j * n, sum = 0.0;
      for (int k = 0; k < i; ++k) sum += q[k] * u[k];
      sum /= half[i];
      for (int k = 0; k < i; ++k) q[k] -= sum * u[k];
    }
  }
}

}  // namespace

// QL steps with implicit shifts until the matrix is diagonal. (Bowdler, Martin, Reinsch, Wilkinson,
// Numer. Math. 11 (1968) 293.) Off-diagonals end when they are small beside their neighbours.
void eigen_tridiagonal(int n, double *d, double *e, int width, double *Q) {
  e[n - 1] = 0.0;
  for (int l = 0; l < n; ++l)
    for (int tries = 0; tries < 60; ++tries) {
      int m = l;
      while (m < n - 1 && std::fabs(e[m]) > 0.5 * epsilon * (std::fabs(d[m]) + std::fabs(d[m + 1])))
        ++m;
      if (m == l) break;
      double g = (d[l + 1] - d[l]) / (2.0 * e[l]), r = std::sqrt(g * g + 1.0);
      g = d[m] - d[l] + e[l] / (g + (g < 0.0 ? -r : r));
      double s = 1.0, c = 1.0, p = 0.0;
      for (int i = m - 1; i >= l; --i) {
        const double f = s * e[i], b = c * e[i];
        const double large = std::max(std::fabs(f), std::fabs(g));
        r = large == 0.0 ? 0.0
                         : large * std::sqrt((f / large) * (f / large) + (g / large) * (g / large));
        e[i + 1] = r;
        if (r == 0.0) {  // the matrix falls apart here
          d[i + 1] -= p;
          e[m] = 0.0;
          break;
        }
        s = f / r, c = g / r;
        g = d[i + 1] - p;
        const double w = (d[i] - g) * s + 2.0 * c * b;
        p = s * w;
        d[i + 1] = g + p;
        g = c * w - b;
        double *x = Q + i * width, *y = x + width;
        for (int k = 0; k < width; ++k) {
          const double a = y[k];
          y[k] = s * x[k] + c * a, x[k] = c * x[k] - s * a;
        }
      }
      if (r == 0.0) continue;
      d[l] -= p, e[l] = g, e[m] = 0.0;
    }
}

void arrange(int n, double *values, double *shapes) {
  std::vector<int> order(sized(n));
  std::iota(order.begin(), order.end(), 0);
  auto key = [&](int k) {
    return values[k] == values[k] ? values[k] : HUGE_VAL;
  };  // what is not a number comes last
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  Numbers old_values(values, values + n), old(shapes, shapes + n * n);
  for (int k = 0; k < n; ++k) {
    const int from = order[k];
    values[k] = old_values[from];
    double largest = 0.0;
    for (int i = 0; i < n; ++i)
      if (std::fabs(old[i * n + from]) > std::fabs(largest)) largest = old[i * n + from];
    for (int i = 0; i < n; ++i)
      shapes[i * n + k] = largest < 0.0 ? -old[i * n + from] : old[i * n + from];
  }
}

void eigen_symmetric(int n, const double *A, double *values, double *vectors) {
  if (n == 0) return;
  std::vector<int> order(sized(n));
  std::iota(order.begin(), order.end(), 0);
  auto key = [&](int k) {
    return A[k * n + k] == A[k * n + k] ? std::fabs(A[k * n + k]) : HUGE_VAL;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  double largest = 0.0;
  for (int k = 0; k < n * n; ++k) largest = std::max(largest, std::fabs(A[k]));
  const double unit = largest > 0.0 ? largest : 1.0;
  Numbers work(sized(n * n)), off(sized(n));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) work[i * n + j] = A[order[i] * n + order[j]] / unit;
  reduce(n, work.data(), values, off.data());
  eigen_tridiagonal(n, values, off.data(), n, work.data());
  for (int k = 0; k < n; ++k) {
    values[k] *= unit;
    for (int i = 0; i < n; ++i) vectors[order[i] * n + k] = work[k * n + i];
  }
  arrange(n, values, vectors);
}

}  // namespace flexura
