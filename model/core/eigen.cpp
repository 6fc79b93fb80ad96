// Eigenproblems of doubles: the symmetric one, and the pencil of a stiffness that may be singular or indefinite.
#include "eigen.hpp"

#include <algorithm>
#include <numeric>

namespace flexura {

namespace {

using Numbers = std::vector<double>;
constexpr double epsilon = 0x1p-52;

std::size_t sized(int n) { return static_cast<std::size_t>(n); }

// Householder's reduction of A (n, n), symmetric and full, from the last row up: A = Q T Q^T with T tridiagonal, `diagonal` (n) and
// `off` (n), off[k] between k and k + 1. A becomes Q^T: row k is the k-th column of Q.
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
    const double length = largest * std::sqrt(square), last = u[i - 1], turned = last > 0.0 ? -length : length;
    off[i - 1] = turned;
    u[i - 1] = last - turned;
    const double h = -turned * u[i - 1];  // u . u / 2
    half[sized(i)] = h;
    double along = 0.0;
    for (int j = 0; j < i; ++j) {  // push = A u / h - u (u . A u) / (2 h^2)
      double sum = 0.0;
      for (int k = 0; k < i; ++k) sum += A[j * n + k] * u[k];
      push[sized(j)] = sum / h;
      along += push[sized(j)] * u[j];
    }
    for (int j = 0; j < i; ++j) push[sized(j)] -= along / (2.0 * h) * u[j];
    for (int j = 0; j < i; ++j) {
      const double a = u[j], b = push[sized(j)];
      double *row = A + j * n;
      for (int k = 0; k < i; ++k) row[k] -= a * push[sized(k)] + b * u[k];
    }
  }
  for (int i = 0; i < n; ++i) diagonal[i] = A[i * n + i];
  // Q = P_{n-1} ... P_2: a reflection changes what the smaller ones have built before it. Rows of Q^T are built in place.
  Numbers u(sized(n)), g(sized(n));
  for (int i = 0; i < n; ++i) {
    double *row = A + i * n;
    std::copy(row, row + i, u.begin());
    std::fill(row, row + i, 0.0);
    row[i] = 1.0;
    for (int j = 0; j < i; ++j) A[j * n + i] = 0.0;
    if (half[sized(i)] == 0.0) continue;
    for (int j = 0; j < i; ++j) {  // row j of Q^T: Q^T (1 - u u^T / h)
      double *q = A + j * n, sum = 0.0;
      for (int k = 0; k < i; ++k) sum += q[k] * u[sized(k)];
      sum /= half[sized(i)];
      for (int k = 0; k < i; ++k) q[k] -= sum * u[sized(k)];
    }
  }
}

// QL steps with implicit shifts on a tridiagonal matrix until it is diagonal; the rows of `Q` (n, n) turn with it.
// (Bowdler, Martin, Reinsch, Wilkinson, Numer. Math. 11 (1968) 293.) Off-diagonals end when they are small beside their neighbours.
void turn_diagonal(int n, double *d, double *e, double *Q) {
  e[n - 1] = 0.0;
  for (int l = 0; l < n; ++l)
    for (int tries = 0; tries < 60; ++tries) {
      int m = l;
      while (m < n - 1 && std::fabs(e[m]) > 0.5 * epsilon * (std::fabs(d[m]) + std::fabs(d[m + 1]))) ++m;
      if (m == l) break;
      double g = (d[l + 1] - d[l]) / (2.0 * e[l]), r = std::sqrt(g * g + 1.0);
      g = d[m] - d[l] + e[l] / (g + (g < 0.0 ? -r : r));
      double s = 1.0, c = 1.0, p = 0.0;
      int i = m - 1;
      for (; i >= l; --i) {
        const double f = s * e[i], b = c * e[i];
        const double large = std::max(std::fabs(f), std::fabs(g));
        r = large == 0.0 ? 0.0 : large * std::sqrt((f / large) * (f / large) + (g / large) * (g / large));
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
        double *x = Q + i * n, *y = Q + (i + 1) * n;
        for (int k = 0; k < n; ++k) {
          const double a = y[k];
          y[k] = s * x[k] + c * a, x[k] = c * x[k] - s * a;
        }
      }
      if (r == 0.0 && i >= l) continue;
      d[l] -= p, e[l] = g, e[m] = 0.0;
    }
}

// M x = mu S x for the lower triangles L of S and G of M, by the symmetric matrix X X^T: `mu` (n) and x (n, n), x . S x = 1, a row each.
void singular(int n, const double *L, const double *G, double *mu, double *rows) {
  Numbers X(sized(n) * sized(n), 0.0), C(sized(n) * sized(n), 0.0), vectors(sized(n) * sized(n));
  for (int j = 0; j < n; ++j) {  // row j: column j of L^-1 G
    double *x = X.data() + j * n;
    for (int i = j; i < n; ++i) x[i] = G[i * n + j];
    solve_lower(n, L, x, j);
    for (int i = j; i < n; ++i)
      for (int k = j; k < n; ++k) C[sized(i * n + k)] += x[i] * x[k];
  }
  eigen_symmetric(n, C.data(), mu, vectors.data());
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < n; ++i) rows[k * n + i] = vectors[sized(i * n + k)];
    solve_upper(n, L, rows + k * n);
  }
}

// The stiffness over the mass of the lower quarter of the unknowns that have a stiffness: near the lowest elastic w^2, rather above.
double first_shift(int n, const double *K, const double *M) {
  double largest = 0.0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, K[i * n + i]);
  Numbers ratios;
  for (int i = 0; i < n; ++i)
    if (M[i * n + i] > 0.0 && K[i * n + i] > 1e-14 * largest) ratios.push_back(K[i * n + i] / M[i * n + i]);
  if (ratios.empty()) return 1.0;
  std::sort(ratios.begin(), ratios.end());
  return ratios[(ratios.size() - 1) / 4];
}

// Whether K is safely positive definite as it is: no row that is nothing but round-off, no small pivot.
bool definite(int n, const double *K) {
  double low = K[0], high = K[0];
  for (int i = 0; i < n; ++i) low = std::min(low, K[i * n + i]), high = std::max(high, K[i * n + i]);
  if (!(low > 1e-14 * high)) return false;
  Numbers L(K, K + n * n);
  return cholesky(n, L.data()) > 1e-9;
}

}  // namespace

void arrange(int n, double *values, double *shapes) {
  std::vector<int> order(sized(n));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return values[a] < values[b]; });
  Numbers old_values(values, values + n), old(shapes, shapes + n * n);
  for (int k = 0; k < n; ++k) {
    const int from = order[sized(k)];
    values[k] = old_values[sized(from)];
    double largest = 0.0;
    for (int i = 0; i < n; ++i)
      if (std::fabs(old[sized(i * n + from)]) > std::fabs(largest)) largest = old[sized(i * n + from)];
    for (int i = 0; i < n; ++i) shapes[i * n + k] = largest < 0.0 ? -old[sized(i * n + from)] : old[sized(i * n + from)];
  }
}

void eigen_symmetric(int n, const double *A, double *values, double *vectors) {
  if (n == 0) return;
  std::vector<int> order(sized(n));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::fabs(A[a * n + a]) < std::fabs(A[b * n + b]); });
  double largest = 0.0;
  for (int k = 0; k < n * n; ++k) largest = std::max(largest, std::fabs(A[k]));
  const double unit = largest > 0.0 ? largest : 1.0;
  Numbers work(sized(n) * sized(n)), off(sized(n));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) work[sized(i * n + j)] = A[order[sized(i)] * n + order[sized(j)]] / unit;
  reduce(n, work.data(), values, off.data());
  turn_diagonal(n, values, off.data(), work.data());
  for (int k = 0; k < n; ++k) {
    values[k] *= unit;
    for (int i = 0; i < n; ++i) vectors[order[sized(i)] * n + k] = work[sized(k * n + i)];
  }
  arrange(n, values, vectors);
}

int eigen_pencil(int n, const double *K, const double *M, double *squares, double *shapes) {
  if (n == 0) return 0;
  const int few = 64;  // up to here rotations, whose small singular values are as accurate as the large ones
  double shift = definite(n, K) ? 0.0 : first_shift(n, K, M);
  bool refined = false;
  Numbers S(K, K + n * n);
  for (int tries = 0;; ++tries) {
    for (int k = 0; k < n * n; ++k) S[sized(k)] = K[k] + shift * M[k];
    Numbers L(S);
    bool positive = true;
    for (int i = 0; i < n; ++i) positive = positive && S[sized(i * n + i)] > 0.0;
    if (shift > 0.0 && !(positive && cholesky(n, L.data()) > 1e-12) && tries < 60) {
      shift *= 16.0;  // K falls in some direction: below -shift
      continue;
    }
    if (n <= few) {
      eigen_definite(n, S.data(), M, squares, shapes);
    } else {
      Numbers scale(sized(n)), G(M, M + n * n), rows(sized(n) * sized(n)), mu(sized(n));
      for (int i = 0; i < n; ++i) scale[sized(i)] = 1.0 / std::sqrt(S[sized(i * n + i)]);
      L = S;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          L[sized(i * n + j)] *= scale[sized(i)] * scale[sized(j)], G[sized(i * n + j)] *= scale[sized(i)] * scale[sized(j)];
      cholesky(n, L.data());
      cholesky(n, G.data(), 8.0 * n * epsilon);
      singular(n, L.data(), G.data(), mu.data(), rows.data());
      const double least = n * epsilon * mu[sized(n - 1)];
      for (int k = 0; k < n; ++k) {
        const double m = mu[sized(k)] > least ? mu[sized(k)] : 0.0, size = m > 0.0 ? 1.0 / std::sqrt(m) : 0.0;
        squares[k] = 1.0 / m;
        for (int i = 0; i < n; ++i) shapes[i * n + k] = rows[sized(k * n + i)] * (scale[sized(i)] * size);
      }
      arrange(n, squares, shapes);
    }
    if (shift == 0.0) break;
    double lowest = shift;  // the smallest square that is no round-off
    for (int k = 0; k < n; ++k) {
      squares[k] -= shift;
      if (std::fabs(squares[k]) > 1e-7 * shift) lowest = std::min(lowest, std::fabs(squares[k]));
    }
    if (lowest >= 1e-5 * shift || refined) break;
    refined = true;  // once more with a shift closer to it, so that the low squares keep their digits
    shift = 100.0 * lowest;
  }
  int finite = 0;
  while (finite < n && squares[finite] <= 1.7976931348623157e308) ++finite;
  return finite;
}

}  // namespace flexura
