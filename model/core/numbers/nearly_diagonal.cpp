// K x = w^2 M x where K is nearly diagonal and M nearly 1: Jacobi's rotations (J. reine angew.
// Math. 30 (1846) 51) of the few pairs that are coupled.
#include <cmath>
#include <utility>

#include "numbers/eigenproblem.hpp"

namespace flexura {

namespace {

using Numbers = std::vector<double>;

// L^-1 B, B (n, n), row by row.
void forward(int n, const Numbers &L, Numbers &B) {
  for (int i = 0; i < n; ++i) {
    double *row = B.data() + std::ptrdiff_t(i) * n;
    for (int k = 0; k < i; ++k) {
      const double part = L[std::size_t(i * n + k)], *above = B.data() + std::ptrdiff_t(k) * n;
      for (int j = 0; j < n; ++j) row[j] -= part * above[j];
    }
    const double inverse = 1.0 / L[std::size_t(i * n + i)];
    for (int j = 0; j < n; ++j) row[j] *= inverse;
  }
}

void turn(int n, double cosine, double sine, double *p, double *q) {
  for (int k = 0; k < n; ++k) {
    const double a = p[k], b = q[k];
    p[k] = cosine * a - sine * b, q[k] = sine * a + cosine * b;
  }
}

}  // namespace

void eigen_nearly_diagonal(int n, const double *K, const double *M, const double *scale,
                           double left, double *squares, double *shapes) {
  const std::size_t size = std::size_t(n) * std::size_t(n);
  Numbers L(M, M + size), C(K, K + size), X(size, 0.0);
  cholesky(n, L.data());
  auto entry = [n](Numbers &A, int i, int j) -> double & { return A[std::size_t(i * n + j)]; };
  forward(n, L, C);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) std::swap(entry(C, i, j), entry(C, j, i));
  forward(n, L, C);  // L^-1 K L^-T
  for (int i = 0; i < n; ++i) entry(X, i, i) = 1.0;
  forward(n, L, X);
  bool turned = true;
  for (int sweep = 0; turned && sweep < 40; ++sweep) {
    turned = false;
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) {
        const double h = entry(C, i, j);
        if (!(std::fabs(h) * n > left * scale[i] * scale[j])) continue;
        turned = true;
        const double low = entry(C, i, i), high = entry(C, j, j), d = high - low, twice = 2.0 * h;
        const double tangent =
            (d < 0.0 ? -twice : twice) / (std::fabs(d) + std::sqrt(d * d + twice * twice));
        const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent), sine = cosine * tangent;
        turn(n, cosine, sine, &entry(C, i, 0), &entry(C, j, 0));
        turn(n, cosine, sine, &entry(X, i, 0), &entry(X, j, 0));
        for (int k = 0; k < n; ++k)
          entry(C, k, i) = entry(C, i, k), entry(C, k, j) = entry(C, j, k);
        entry(C, i, i) = low - tangent * h, entry(C, j, j) = high + tangent * h;
        entry(C, i, j) = entry(C, j, i) = 0.0;
      }
  }
  for (int k = 0; k < n; ++k) {
    squares[k] = entry(C, k, k);
    for (int i = 0; i < n; ++i) shapes[i * n + k] = entry(X, k, i);
  }
}

}  // namespace flexura
