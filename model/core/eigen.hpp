// Dense symmetric matrices: triangles, and the eigenproblems A x = l x and K x = w^2 M x.
//
// Only + - * / and square roots are used, in an order that nothing outside decides: the same digits on every machine.
// Matrices are (n, n), row by row. Vectors come out as columns: component i of vector k stands at [i * n + k], values ascend,
// and the largest component of each vector is positive.
//
// Low frequencies are the ones that matter, and w^2 spans 1e12 and more. So K x = w^2 M x is solved as M x = mu K x, mu = 1/w^2,
// with K = L L^T and M = G G^T: the singular values of X = L^-1 G are the 1/w. Rotations make the columns of X orthogonal
// (Hestenes, J. SIAM 6 (1958) 51); they find small singular values of badly scaled columns as accurately as large ones
// (Demmel, Veselic, SIAM J. Matrix Anal. Appl. 13 (1992) 1204). M may have zero mass in a direction: w is infinite there.
#pragma once
#include <vector>

#include "lanes.hpp"

namespace flexura {

// A = L L^T: the lower triangle of A (n, n) becomes L; the upper one is not read. A pivot that is at most `floor` times what
// stood on the diagonal is taken for zero, and so is its column (A semidefinite). Returns the least ratio of a pivot to what stood
// on the diagonal: not above 0 where A is not positive definite.
template <class Real> Real cholesky(int n, Real *A, double floor = 0.0) {
  Real worst_ratio = 1.0;
  for (int j = 0; j < n; ++j) {
    Real *row = A + j * n, pivot = row[j];
    for (int k = 0; k < j; ++k) pivot -= row[k] * row[k];
    const Real limit = floor * abs(row[j]), ratio = pivot / choose_less(Real(0.0), abs(row[j]), abs(row[j]), Real(1.0));
    worst_ratio = smaller(worst_ratio, ratio);
    const Real length = root(choose_less(limit, pivot, pivot, Real(0.0)));
    const Real inverse = choose_less(Real(0.0), length, 1.0 / length, Real(0.0));
    row[j] = length;
    for (int i = j + 1; i < n; ++i) {
      Real *below = A + i * n, sum = below[j];
      for (int k = 0; k < j; ++k) sum -= below[k] * row[k];
      below[j] = sum * inverse;
    }
  }
  return worst_ratio;
}

// x = L^-1 x and x = L^-T x with the lower triangle L (n, n); `from`: x is zero before it.
template <class Real> void solve_lower(int n, const Real *L, Real *x, int from = 0) {
  for (int i = from; i < n; ++i) {
    Real sum = x[i];
    for (int k = from; k < i; ++k) sum -= L[i * n + k] * x[k];
    x[i] = sum / L[i * n + i];
  }
}
template <class Real> void solve_upper(int n, const Real *L, Real *x) {
  for (int i = n - 1; i >= 0; --i) {
    x[i] = x[i] / L[i * n + i];
    for (int k = 0; k < i; ++k) x[k] -= L[i * n + k] * x[i];
  }
}

// Squares and the product of two vectors; four sums, so that one robot fills the register that four robots fill.
template <class Real> struct Products { Real pp, qq, pq; };
template <class Real> inline Real together(const Real *s) { return (s[0] + s[1]) + (s[2] + s[3]); }
template <class Real> Products<Real> products(int count, const Real *p, const Real *q) {  // count: a multiple of four
  Real pp[4] = {0.0, 0.0, 0.0, 0.0}, qq[4] = {0.0, 0.0, 0.0, 0.0}, pq[4] = {0.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < count; k += 4)
    for (int l = 0; l < 4; ++l) {
      const Real a = p[k + l], b = q[k + l];
      pp[l] += a * a, qq[l] += b * b, pq[l] += a * b;
    }
  return {together(pp), together(qq), together(pq)};
}

// Rotates `count` vectors of `length` (a multiple of four), one a row of X, until all are orthogonal: X = X W with W orthogonal.
// A pair that is orthogonal to the last digits is left as it is, so a lane's digits do not depend on its neighbours.
template <class Real> void orthogonalise(int count, int length, Real *X) {
  const double enough = 0x1p-50;
  for (int sweep = 0; sweep < 40; ++sweep) {
    double rotated = 0.0;
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j) {
        Real *p = X + i * length, *q = X + j * length;
        const Products<Real> s = products(length, p, q);
        const Real rest = choose_less(enough * (root(s.pp) * root(s.qq)), abs(s.pq), s.pq, Real(0.0));
        const double largest = worst(abs(rest));
        if (!(largest > 0.0)) continue;
        rotated = 1.0;
        const Real d = s.qq - s.pp, h = 2.0 * rest, side = choose_less(d, Real(0.0), -h, h);
        const Real tangent = side / (abs(d) + root(d * d + h * h) + 1e-300);
        const Real cosine = 1.0 / root(1.0 + tangent * tangent), sine = cosine * tangent;
        for (int k = 0; k < length; ++k) {
          const Real a = p[k], b = q[k];
          p[k] = cosine * a - sine * b, q[k] = sine * a + cosine * b;
        }
      }
    if (rotated == 0.0) return;
  }
}

// Columns of `shapes` by ascending `values` (count), the largest component of each positive; lane by lane.
void arrange(int n, double *values, double *shapes);
template <int N> void arrange(int n, Pack<N> *values, Pack<N> *shapes) {
  std::vector<double> value(static_cast<std::size_t>(n)), shape(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for (int lane = 0; lane < N; ++lane) {
    for (int k = 0; k < n; ++k) value[static_cast<std::size_t>(k)] = values[k][lane];
    for (int k = 0; k < n * n; ++k) shape[static_cast<std::size_t>(k)] = shapes[k][lane];
    arrange(n, value.data(), shape.data());
    for (int k = 0; k < n; ++k) values[k].set(lane, value[static_cast<std::size_t>(k)]);
    for (int k = 0; k < n * n; ++k) shapes[k].set(lane, shape[static_cast<std::size_t>(k)]);
  }
}

// K x = w^2 M x with K positive definite, M positive semidefinite: `squares` (n) of w, ascending, and `shapes` (n, n) with
// x . M x = 1. A direction without mass has w^2 infinite and a shape of zeros. For doubles and packs, with the same digits.
template <class Real> void eigen_definite(int n, const Real *K, const Real *M, Real *squares, Real *shapes) {
  const int length = (n + 3) / 4 * 4;
  const std::size_t size = static_cast<std::size_t>(n);
  std::vector<Real> L(size * size), G(size * size), X(size * static_cast<std::size_t>(length), Real(0.0)), scale(size);
  for (int i = 0; i < n; ++i) scale[static_cast<std::size_t>(i)] = 1.0 / root(K[i * n + i]);  // the unit diagonal
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      const Real both = scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
      const std::size_t at = static_cast<std::size_t>(i * n + j);
      L[at] = K[at] * both, G[at] = M[at] * both;
    }
  cholesky(n, L.data());
  cholesky(n, G.data(), 8.0 * n * 0x1p-52);
  for (int j = 0; j < n; ++j) {
    Real *x = X.data() + j * length;
    for (int i = j; i < n; ++i) x[i] = G[static_cast<std::size_t>(i * n + j)];
    solve_lower(n, L.data(), x, j);
  }
  orthogonalise(n, length, X.data());
  for (int k = 0; k < n; ++k) {
    Real *x = X.data() + k * length;
    const Real mu = products(length, x, x).pp;
    squares[k] = 1.0 / mu;
    solve_upper(n, L.data(), x);
    const Real inverse = choose_less(Real(0.0), mu, squares[k], Real(0.0));
    for (int i = 0; i < n; ++i) shapes[i * n + k] = x[i] * (scale[static_cast<std::size_t>(i)] * inverse);
  }
  arrange(n, squares, shapes);
}

// A x = l x, A symmetric: `values` (n) ascending, `vectors` (n, n) orthonormal. By Householder's reflections to three diagonals
// and QL steps on these, after the rows are put in the order of their diagonal: small values of graded matrices keep their digits.
void eigen_symmetric(int n, const double *A, double *values, double *vectors);

// K x = w^2 M x with K symmetric, whether definite or not, and M positive semidefinite: `squares` (n) of w, ascending, negative in
// unstable directions, 0 up to round-off where nothing holds the motion, infinite without mass; `shapes` (n, n), x . M x = 1.
// Returns how many squares are finite.
int eigen_pencil(int n, const double *K, const double *M, double *squares, double *shapes);

}  // namespace flexura
