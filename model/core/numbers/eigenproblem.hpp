// Dense symmetric matrices: triangles, and the eigenproblems A x = l x and K x = w^2 M x.
//
// Only + - * / and square roots are used, in an order that nothing outside decides: the same digits
// on every machine. Matrices are (n, n), row by row. Vectors come out as columns: component i of
// vector k stands at [i
// * n + k], values ascend, and the largest component of each vector is positive.
//
// Low frequencies are the ones that matter, and w^2 spans 1e12 and more. So K x = w^2 M x is solved
// as M x = mu K x, mu = 1/w^2, with K = L L^T and M = G G^T: the singular values of X = L^-1 G are
// the 1/w. Rotations make the columns of X orthogonal (Hestenes, J. SIAM 6 (1958) 51); they find
// small singular values of badly scaled columns as accurately as large ones (Demmel, Veselic, SIAM
// J. Matrix Anal. Appl. 13 (1992) 1204), and soon, if G has its pivots in descending order (Drmac,
// Veselic, same journal, 29 (2008) 1322). M may have zero mass in a direction: w is infinite there.
#pragma once
#include <vector>

#include "numbers/pack.hpp"

namespace flexura {

// A = L L^T: the lower triangle of A (n, n) becomes L; the upper one is not read. A pivot that is
// at most `floor` times what stood on the diagonal is taken for zero, and so is its column (A
// semidefinite). Returns the least ratio of a pivot to what stood on the diagonal: not above 0 if A
// is not positive definite.
template <class Real>
Real cholesky(int n, Real *A, double floor = 0.0) {
  Real worst_ratio = 1.0;
  std::vector<Real> first(static_cast<std::size_t>(n)), column(first);
  for (int j = 0; j < n; ++j) first[std::size_t(j)] = A[j * n + j];
  for (int j = 0; j < n; ++j) {
    const Real pivot = A[j * n + j], size = abs(first[std::size_t(j)]), limit = floor * size,
               ratio = pivot / choose_less(Real(0.0), size, size, Real(1.0));
    worst_ratio = smaller(worst_ratio, ratio);
    const Real length = root(choose_less(limit, pivot, pivot, Real(0.0)));
    const Real inverse = choose_less(Real(0.0), length, 1.0 / length, Real(0.0));
    A[j * n + j] = length;
    for (int i = j + 1; i < n; ++i) {
      Real *below = A + i * n;
      const Real own = below[j] * inverse;
      below[j] = column[std::size_t(i)] = own;
      for (int k = j + 1; k <= i; ++k) below[k] -= own * column[std::size_t(k)];
    }
  }
  return worst_ratio;
}

// x = L^-1 x and x = L^-T x with the lower triangle L (n, n); `from`: x is zero before it.
template <class Real>
void solve_lower(int n, const Real *L, Real *x, int from = 0) {
  for (int i = from; i < n; ++i) {
    Real sum = x[i];
    for (int k = from; k < i; ++k) sum -= L[i * n + k] * x[k];
    x[i] = sum / L[i * n + i];
  }
}
template <class Real>
void solve_upper(int n, const Real *L, Real *x) {
  for (int i = n - 1; i >= 0; --i) {
    x[i] = x[i] / L[i * n + i];
    for (int k = 0; k < i; ++k) x[k] -= L[i * n + k] * x[i];
  }
}

// The sum of four partial sums, which do not wait for each other.
inline double together(const double *s) { return (s[0] + s[1]) + (s[2] + s[3]); }

// Columns of `shapes` (n, n) by ascending `values` (n), the largest component of each positive.
void arrange(int n, double *values, double *shapes);

// K x = w^2 M x with K positive definite, M positive semidefinite: `squares` (n) of w, ascending,
// and `shapes` (n, n) with x . M x = 1. A direction without mass has w^2 infinite and a shape of
// zeros.
void eigen_definite(int n, const double *K, const double *M, double *squares, double *shapes);

// The same of N robots in a pack, lane by lane.
template <int N>
void eigen_definite(int n, const Pack<N> *K, const Pack<N> *M, Pack<N> *squares, Pack<N> *shapes) {
  const std::size_t size = std::size_t(n);
  std::vector<double> k(size * size), m(size * size), w(size), x(size * size);
  for (int lane = 0; lane < N; ++lane) {
    for (std::size_t i = 0; i < size * size; ++i) k[i] = K[i][lane], m[i] = M[i][lane];
    eigen_definite(n, k.data(), m.data(), w.data(), x.data());
    for (std::size_t i = 0; i < size; ++i) squares[i].set(lane, w[i]);
    for (std::size_t i = 0; i < size * size; ++i) shapes[i].set(lane, x[i]);
  }
}

// A x = l x, A symmetric: `values` (n) ascending, `vectors` (n, n) orthonormal. By Householder's
// reflections to three diagonals and QL steps on these, after the rows are put in the order of
// their diagonal: small values of graded matrices keep their digits.
void eigen_symmetric(int n, const double *A, double *values, double *vectors);

// T x = l x, T tridiagonal: `values` (n) its diagonal on entry, `off` (n) beside it, k between k
// and k + 1, lost. Values come out in no order; the rows of Q (n, width) turn with them: from 1
// they become the vectors, from one column of 1 that component of every vector. Rows in ascending
// order of their diagonal keep digits.
void eigen_tridiagonal(int n, double *values, double *off, int width, double *Q);

// K x = w^2 M x with K symmetric, whether definite or not, and M positive semidefinite: `squares`
// (n) of w, ascending, negative in unstable directions, 0 up to round-off where nothing holds the
// motion, infinite without mass; `shapes` (n, n), x . M x = 1. Returns how many squares are finite.
int eigen_pencil(int n, const double *K, const double *M, double *squares, double *shapes);

}  // namespace flexura
