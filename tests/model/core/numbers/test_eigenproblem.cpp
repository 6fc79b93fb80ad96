// Eigenproblems: residuals and orthogonality on random and graded matrices, exact spectra, free and
// massless directions.
#include "numbers/eigenproblem.hpp"

#include "check.hpp"
#include "numbers/scalars.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

std::size_t sized(int n) { return static_cast<std::size_t>(n); }
double &at(Numbers &A, int n, int i, int j) { return A[sized(i * n + j)]; }

Numbers random_symmetric(int n, check::Random &random) {
  Numbers A(sized(n * n));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) at(A, n, i, j) = at(A, n, j, i) = random(-1.0, 1.0);
  return A;
}

// A = B B^T + small I, then rows and columns scaled over `decades`.
Numbers random_definite(int n, double decades, check::Random &random) {
  Numbers B = random_symmetric(n, random), A(sized(n * n), 0.0), scale(sized(n));
  for (double &s : scale) s = std::exp(2.302585092994046 * decades * random(-0.5, 0.5));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      double sum = i == j ? 0.1 : 0.0;
      for (int k = 0; k < n; ++k) sum += at(B, n, i, k) * at(B, n, j, k);
      at(A, n, i, j) = sum * scale[sized(i)] * scale[sized(j)];
    }
  return A;
}

// Largest |x_a . A x_b - (a == b) value_a| beside sqrt(value_a value_b), A given by rows, x by
// columns.
double off(int n, Numbers &A, Numbers &x, const Numbers &value) {
  double worst = 0.0;
  for (int b = 0; b < n; ++b) {
    Numbers y(sized(n), 0.0);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) y[sized(i)] += at(A, n, i, j) * at(x, n, j, b);
    for (int a = 0; a < n; ++a) {
      double sum = a == b ? -value[sized(a)] : 0.0;
      for (int i = 0; i < n; ++i) sum += at(x, n, i, a) * y[sized(i)];
      worst = std::fmax(worst,
                        std::fabs(sum) / std::sqrt(std::fabs(value[sized(a)] * value[sized(b)])));
    }
  }
  return worst;
}

}  // namespace

TEST("A x = l x: residual, orthonormal vectors, ascending values, the sign of vectors") {
  check::Random random;
  for (int n : {1, 2, 3, 7, 20, 61, 200}) {
    Numbers A = random_symmetric(n, random), values(sized(n)), x(sized(n * n));
    eigen_symmetric(n, A.data(), values.data(), x.data());
    double residual = 0.0, apart = 0.0;
    for (int k = 0; k < n; ++k) {
      double largest = 0.0;
      for (int i = 0; i < n; ++i) {
        double sum = -values[sized(k)] * at(x, n, i, k), dot = i == k ? -1.0 : 0.0;
        for (int j = 0; j < n; ++j)
          sum += at(A, n, i, j) * at(x, n, j, k), dot += at(x, n, j, i) * at(x, n, j, k);
        residual = std::fmax(residual, std::fabs(sum)), apart = std::fmax(apart, std::fabs(dot));
        if (std::fabs(at(x, n, i, k)) > std::fabs(largest)) largest = at(x, n, i, k);
      }
      CHECK(largest > 0.0);
      CHECK(k == 0 || values[sized(k)] >= values[sized(k - 1)]);
    }
    CHECK_NEAR(residual, 0.0, 4e-15 * n);
    CHECK_NEAR(apart, 0.0, 4e-15 * (1 + n / 4.0));
  }
}

TEST("the second difference: 4 sin^2(k pi / (2 (n + 1))); a matrix of zeros; a diagonal one") {
  const int n = 50;
  Numbers A(sized(n * n), 0.0), values(sized(n)), x(sized(n * n));
  eigen_symmetric(n, A.data(), values.data(), x.data());
  CHECK(values[0] == 0.0 && values[n - 1] == 0.0 && x[0] == 1.0);
  for (int i = 0; i < n; ++i) {
    at(A, n, i, i) = 2.0;
    if (i) at(A, n, i, i - 1) = at(A, n, i - 1, i) = -1.0;
  }
  eigen_symmetric(n, A.data(), values.data(), x.data());
  for (int k = 0; k < n; ++k) {
    double s, c;
    sincos((k + 1) * 0.5 * 3.14159265358979324 / (n + 1), s, c);
    CHECK_NEAR(values[sized(k)], 4.0 * s * s, 3e-15);
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) at(A, n, i, j) = i == j ? n - i : 0.0;
  eigen_symmetric(n, A.data(), values.data(), x.data());
  for (int k = 0; k < n; ++k) CHECK_NEAR(values[sized(k)], k + 1.0, 1e-13);
}

TEST("graded matrices keep their small values: D A D with D over twelve decades") {
  // Hilbert-like 3 x 3 block [2 1; 1 2] scaled by 1, 1e-6: the small value is 1.5e-12 (1 +
  // O(1e-12))
  Numbers A = {2.0, 1e-6, 1e-6, 2e-12}, values(2), x(4);
  eigen_symmetric(2, A.data(), values.data(), x.data());
  CHECK_NEAR(values[0] / 1.5e-12, 1.0, 1e-11);
  check::Random random;
  for (int n : {6, 26, 50}) {  // and K x = w^2 M x with both graded, each its own way
    Numbers K = random_definite(n, 6.0, random), M = random_definite(n, 4.0, random),
            squares(sized(n)), shapes(sized(n * n));
    CHECK(eigen_pencil(n, K.data(), M.data(), squares.data(), shapes.data()) == n);
    CHECK_NEAR(off(n, M, shapes, Numbers(sized(n), 1.0)), 0.0, 1e-6);  // w spans ten decades
    CHECK_NEAR(off(n, K, shapes, squares), 0.0, 2e-9);
  }
}

TEST(
    "K x = w^2 M x: products of the squares are det K / det M; large sizes go another way, to the "
    "same "
    "values") {
  check::Random random;
  const int n = 90;
  Numbers K = random_definite(n, 2.0, random), M = random_definite(n, 2.0, random), a(sized(n)),
          b(sized(n)), shapes(sized(n * n));
  CHECK(eigen_pencil(n, K.data(), M.data(), a.data(), shapes.data()) == n);
  CHECK_NEAR(off(n, M, shapes, Numbers(sized(n), 1.0)), 0.0, 1e-8);
  eigen_definite(n, K.data(), M.data(), b.data(), shapes.data());
  CHECK_NEAR(off(n, M, shapes, Numbers(sized(n), 1.0)), 0.0, 1e-10);
  for (int k = 0; k < n; ++k) CHECK_NEAR(a[sized(k)] / b[sized(k)], 1.0, 1e-8);
  Numbers LK = K, LM = M;
  cholesky(n, LK.data()), cholesky(n, LM.data());
  double product = 0.0;
  for (int k = 0; k < n; ++k)
    product += std::log(b[sized(k)]) - 2.0 * std::log(at(LK, n, k, k) / at(LM, n, k, k));
  CHECK_NEAR(product, 0.0, 1e-9);
}

TEST("free directions have w = 0, unstable ones w^2 < 0, massless ones w infinite") {
  // masses 1, 1, 1 on a line with springs 1 and 100 between: w^2 = 0, 1.4962547, 200.50374...
  Numbers K = {1, -1, 0, -1, 101, -100, 0, -100, 100}, M = {1, 0, 0, 0, 1, 0, 0, 0, 1}, w(3), x(9);
  CHECK(eigen_pencil(3, K.data(), M.data(), w.data(), x.data()) == 3);
  CHECK_NEAR(w[0], 0.0, 1e-12);
  CHECK_NEAR(w[1] * w[2], 300.0, 1e-10);
  CHECK_NEAR(w[1] + w[2], 202.0, 1e-11);
  K[0] -= 0.5;  // pushed away from its place
  CHECK(eigen_pencil(3, K.data(), M.data(), w.data(), x.data()) == 3);
  CHECK(w[0] < 0.0);
  CHECK_NEAR(w[0] + w[1] + w[2], 201.5, 1e-11);
  Numbers stiff = {2, 1, 1, 2}, light = {4, 0, 0, 0}, v(2), y(4);
  CHECK(eigen_pencil(2, stiff.data(), light.data(), v.data(), y.data()) == 1);
  CHECK_NEAR(v[0], 1.5 / 4.0, 1e-15);  // the massless unknown follows: x_2 = -x_1 / 2
  CHECK_NEAR(y[2] / y[0], -0.5, 1e-15);
  CHECK_NEAR(y[0], 0.5, 1e-15);
}

TEST("no unknowns have no modes") {
  eigen_symmetric(0, nullptr, nullptr, nullptr);
  CHECK(eigen_pencil(0, nullptr, nullptr, nullptr, nullptr) == 0);
}

TEST("a rigid motion beside stiff and soft modes does not spoil the soft ones") {
  // K = diag(0, 1, 1e8, 1e12), M = 1 + a a^T: compare with the same without the free row, and the
  // free one moved by 1e-6
  const int n = 4;
  Numbers K(16, 0.0), M(16), w(4), x(16);
  const double a[4] = {1.0, 0.5, 0.25, 0.125};
  at(K, n, 1, 1) = 1.0, at(K, n, 2, 2) = 1e8, at(K, n, 3, 3) = 1e12;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) at(M, n, i, j) = (i == j) + a[i] * a[j];
  CHECK(eigen_pencil(n, K.data(), M.data(), w.data(), x.data()) == 4);
  CHECK_NEAR(w[0], 0.0, 1e-9);
  // of the two softest alone: M_22 without the free motion = 1.25 - 0.25/2
  CHECK_NEAR(w[1], 1.0 / 1.125, 2e-8);
  CHECK_NEAR(off(n, M, x, Numbers(4, 1.0)), 0.0, 1e-12);
}

TEST("four pencils in a pack: each lane has the digits of a double") {
  check::Random random;
  for (int n : {1, 4, 11}) {
    std::vector<Pack<4>> K(sized(n * n)), M(sized(n * n)), w(sized(n)), x(sized(n * n));
    Numbers k[4], m[4], v(sized(n)), y(sized(n * n));
    for (int lane = 0; lane < 4; ++lane) {
      k[lane] = random_definite(n, 3.0 * lane, random), m[lane] = random_definite(n, 2.0, random);
      for (int i = 0; i < n * n; ++i)
        K[sized(i)].set(lane, k[lane][sized(i)]), M[sized(i)].set(lane, m[lane][sized(i)]);
    }
    eigen_definite(n, K.data(), M.data(), w.data(), x.data());
    for (int lane = 0; lane < 4; ++lane) {
      eigen_definite(n, k[lane].data(), m[lane].data(), v.data(), y.data());
      for (int i = 0; i < n; ++i) CHECK(check::same_bits(w[sized(i)][lane], v[sized(i)]));
      for (int i = 0; i < n * n; ++i) CHECK(check::same_bits(x[sized(i)][lane], y[sized(i)]));
    }
  }
}

TEST("triangles: A = L L^T, solves, a semidefinite matrix, one that is not definite") {
  check::Random random;
  const int n = 30;
  Numbers A = random_definite(n, 1.0, random), L = A, x(sized(n)), b(sized(n), 0.0);
  CHECK(cholesky(n, L.data()) > 0.0);
  for (double &z : x) z = random(-1.0, 1.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) b[sized(i)] += at(A, n, i, j) * x[sized(j)];
  solve_lower(n, L.data(), b.data());
  solve_upper(n, L.data(), b.data());
  for (int i = 0; i < n; ++i) CHECK_NEAR(b[sized(i)], x[sized(i)], 1e-10);
  Numbers S = {1, 2, 2, 4};
  cholesky(2, S.data(), 1e-14);
  CHECK(S[3] == 0.0 && S[2] == 2.0);
  Numbers N = {1, 2, 2, 3};
  CHECK(cholesky(2, N.data()) < 0.0);
}

TEST("a pencil whose diagonal hides that it is indefinite: exact squares") {
  for (double off : {10.0, 1e3, 1e6}) {
    const Numbers K{1.0, off, off, 1.0}, M{1.0, 0.0, 0.0, 1.0};
    Numbers squares(2), shapes(4);
    CHECK(eigen_pencil(2, K.data(), M.data(), squares.data(), shapes.data()) == 2);
    CHECK_NEAR(squares[0], 1.0 - off, 1e-9 * off);
    CHECK_NEAR(squares[1], 1.0 + off, 1e-9 * off);
  }
}

TEST("a square far below the others keeps its digits beside one that is nothing") {
  for (double low : {1e-4, 1e-6, 1e-7}) {
    Numbers K(9), M(9, 0.0), squares(3), shapes(9);
    const double b[3] = {std::sqrt(0.5), -std::sqrt(0.5), 0.0};
    const double c[3] = {std::sqrt(1.0 / 6), std::sqrt(1.0 / 6), -std::sqrt(2.0 / 3)};
    for (int i = 0; i < 3; ++i) {
      at(M, 3, i, i) = 1.0;
      for (int j = 0; j < 3; ++j) at(K, 3, i, j) = low * b[i] * b[j] + c[i] * c[j];
    }
    CHECK(eigen_pencil(3, K.data(), M.data(), squares.data(), shapes.data()) == 3);
    CHECK_NEAR(squares[0], 0.0, 1e-15);
    CHECK_NEAR(squares[1], low, 1e-15);
    CHECK_NEAR(squares[2], 1.0, 1e-14);
  }
}
