// K x = w^2 M x: by rotations that make the columns of L^-1 G orthogonal, and of a stiffness that
// may be singular or indefinite.
#include <algorithm>
#include <numeric>

#include "numbers/eigenproblem.hpp"

namespace flexura {

namespace {

using Numbers = std::vector<double>;
constexpr double epsilon = 0x1p-52;

std::size_t sized(int n) { return static_cast<std::size_t>(n); }

// A = G G^T for a semidefinite A (n, n), which is overwritten, its pivots in descending order.
// Columns of G are rows of `G` (n, length), length >= n; from the first pivot on that is round-off
// beside the first of all they are zero.
void pivoted(int n, double *A, int length, double *G) {
  std::vector<int> order(sized(n));
  std::iota(order.begin(), order.end(), 0);
  Numbers first(sized(n));
  for (int i = 0; i < n; ++i) first[i] = A[i * n + i];
  for (int j = 0; j < n; ++j) {
    int best = j;
    for (int i = j + 1; i < n; ++i)
      if (A[order[i] * n + order[i]] > A[order[best] * n + order[best]]) best = i;
    std::swap(order[j], order[best]);
    const int p = order[j];
    const double pivot = A[p * n + p];
    double *g = G + j * length;
    if (!(pivot > std::max(16, n) * epsilon * first[p])) continue;
    const double size = std::sqrt(pivot);
    g[p] = size;
    for (int i = j + 1; i < n; ++i) g[order[i]] = A[p * n + order[i]] / size;
    for (int i = j + 1; i < n; ++i) {
      double *row = A + order[i] * n;
      const double share = g[order[i]];
      for (int k = j + 1; k < n; ++k) row[order[k]] -= share * g[order[k]];
    }
  }
}

// Rotates `count` vectors of `length` (a multiple of four), one a row of X, until all are
// orthogonal: X = W X with W orthogonal. The squares of their lengths, by which a rotation is
// chosen, are kept up to date, and formed anew before each sweep.
void orthogonalise(int count, int length, double *X) {
  const double enough = 0x1p-50;  // a cosine between two vectors that is round-off
  Numbers squares(sized(count));
  auto product = [length](const double *p, const double *q) {
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < length; k += 4)
      for (int l = 0; l < 4; ++l) sum[l] += p[k + l] * q[k + l];
    return together(sum);
  };
  for (int sweep = 0; sweep < 40; ++sweep) {
    for (int i = 0; i < count; ++i) squares[i] = product(X + i * length, X + i * length);
    bool rotated = false;
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j) {
        double *p = X + i * length, *q = X + j * length;
        const double pq = product(p, q), pp = squares[i], qq = squares[j];
        if (!(std::fabs(pq) > enough * std::sqrt(pp) * std::sqrt(qq))) continue;
        rotated = true;
        const double d = qq - pp, h = 2.0 * pq;
        const double tangent =
            (d < 0.0 ? -h : h) / (std::fabs(d) + std::sqrt(d * d + h * h) + 1e-300);
        const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent), sine = cosine * tangent;
        for (int k = 0; k < length; ++k) {
          const double a = p[k], b = q[k];
          p[k] = cosine * a - sine * b, q[k] = sine * a + cosine * b;
        }
        squares[i] = std::max(pp - tangent * pq, 0.0), squares[j] = qq + tangent * pq;
      }
    if (!rotated) return;
  }
}

// The same for many vectors: by the eigenvectors of the matrix of their products, to the digits of
// the largest of them.
void orthogonalise_many(int count, int length, double *X) {
  Numbers C(sized(count) * sized(count), 0.0), mu(sized(count)), W(C.size()),
      Y(sized(count) * sized(length), 0.0);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum[4] = {0.0, 0.0, 0.0, 0.0};
      for (int k = 0; k < length; k += 4)
        for (int l = 0; l < 4; ++l) sum[l] += X[i * length + k + l] * X[j * length + k + l];
      C[i * count + j] = C[j * count + i] = together(sum);
    }
  eigen_symmetric(count, C.data(), mu.data(), W.data());
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < count; ++k) {
      const double part = W[i * count + k];
      for (int l = 0; l < length; ++l) Y[k * length + l] += part * X[i * length + l];
    }
  std::copy(Y.begin(), Y.end(), X);
}

// The stiffness over the mass of the lower quarter of the unknowns that have a stiffness: near the
// lowest elastic w^2, rather above.
double first_shift(int n, const double *K, const double *M) {
  double largest = 0.0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, K[i * n + i]);
  Numbers ratios;
  for (int i = 0; i < n; ++i)
    if (M[i * n + i] > 0.0 && K[i * n + i] > 1e-14 * largest)
      ratios.push_back(K[i * n + i] / M[i * n + i]);
  if (ratios.empty()) return 1.0;
  std::sort(ratios.begin(), ratios.end());
  return ratios[(ratios.size() - 1) / 4];
}

// Whether K is safely positive definite as it is: no row that is nothing but round-off, no small
// pivot.
bool definite(int n, const double *K) {
  double low = K[0], high = K[0];
  for (int i = 0; i < n; ++i)
    low = std::min(low, K[i * n + i]), high = std::max(high, K[i * n + i]);
  if (!(low > 1e-14 * high)) return false;
  Numbers L(K, K + n * n);
  return cholesky(n, L.data()) > 1e-9;
}

Numbers sum_of(int n, const double *K, double shift, const Numbers &M) {
  Numbers S(K, K + n * n);
  for (int k = 0; k < n * n; ++k) S[k] += shift * M[k];
  return S;
}

// A shift, `from` or more, that makes K + shift M safely positive definite: more than the most
// negative square. If M is so badly conditioned that there is none, its diagonal is raised by what
// is round-off then.
double raised(int n, const double *K, Numbers &M, double from) {
  for (int times = 0; times < 2; ++times) {
    double shift = from;
    for (int tries = 0; tries < 16; ++tries, shift *= 16.0) {
      Numbers S = sum_of(n, K, shift, M);
      bool positive = true;
      for (int i = 0; i < n; ++i) positive = positive && S[i * n + i] > 0.0;
      if (positive && cholesky(n, S.data()) > 1e-12) return shift;
    }
    if (times == 0)
      for (int i = 0; i < n; ++i) M[i * n + i] *= 1.0 + 1e-11;
  }
  return from;
}

}  // namespace

void eigen_definite(int n, const double *K, const double *M, double *squares, double *shapes) {
  const int length = (n + 3) / 4 * 4, few = 100;  // beyond, rotations take too long
  Numbers L(K, K + n * n), C(M, M + n * n), X(sized(n) * sized(length), 0.0), scale(sized(n));
  for (int i = 0; i < n; ++i) scale[i] = 1.0 / std::sqrt(K[i * n + i]);  // to the unit diagonal
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      L[i * n + j] *= scale[i] * scale[j], C[i * n + j] *= scale[i] * scale[j];
  cholesky(n, L.data());
  pivoted(n, C.data(), length, X.data());
  Numbers across(L.size());  // L^T, whose rows are read in a row
  for (int i = 0; i < n; ++i)
    for (int k = 0; k <= i; ++k) across[k * n + i] = L[i * n + k];
  for (int k = 0; k < n; ++k) {
    double *x = X.data() + k * length;
    for (int i = 0; i < n; ++i) {
      const double *row = across.data() + i * n, own = x[i] /= row[i];
      for (int j = i + 1; j < n; ++j) x[j] -= row[j] * own;
    }
  }
  n <= few ? orthogonalise(n, length, X.data()) : orthogonalise_many(n, length, X.data());
  double heaviest = 0.0;
  for (int k = 0; k < n; ++k) {
    double *x = X.data() + k * length, mu = 0.0;
    for (int i = 0; i < n; ++i) mu += x[i] * x[i];
    heaviest = std::max(heaviest, mu);
    squares[k] = mu;
  }
  for (int k = 0; k < n; ++k) {
    double *x = X.data() + k * length;
    const double mu =
        squares[k] > (n <= few ? 0.0 : epsilon * epsilon * n * heaviest) ? squares[k] : 0.0;
    const double inverse = mu > 0.0 ? 1.0 / mu : 0.0;
    squares[k] = 1.0 / mu;
    solve_upper(n, L.data(), x);
    for (int i = 0; i < n; ++i) shapes[i * n + k] = x[i] * (scale[i] * inverse);
  }
  arrange(n, squares, shapes);
}

int eigen_pencil(int n, const double *K, const double *M, double *squares, double *shapes) {
  if (n == 0) return 0;
  Numbers mass(M, M + n * n);
  if (definite(n, K)) {
    eigen_definite(n, K, mass.data(), squares, shapes);
  } else {
    double shift = first_shift(n, K, M);
    for (int times = 0; times < 2; ++times) {
      shift = raised(n, K, mass, shift);
      eigen_definite(n, sum_of(n, K, shift, mass).data(), mass.data(), squares, shapes);
      double lowest = shift;  // the smallest square that is no round-off
      for (int k = 0; k < n; ++k) {
        squares[k] -= shift;
        if (std::fabs(squares[k]) > 1e-7 * shift) lowest = std::min(lowest, std::fabs(squares[k]));
      }
      if (lowest >= 1e-5 * shift) break;
      shift =
          100.0 *
          lowest;  // once more with a shift closer to it, so that the low squares keep their digits
    }
  }
  int finite = 0;
  while (finite < n && squares[finite] <= 1.7976931348623157e308) ++finite;
  return finite;
}

}  // namespace flexura
