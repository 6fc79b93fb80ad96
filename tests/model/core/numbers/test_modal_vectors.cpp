// Products of square matrices of any size, and the inner product in both layouts.
#include "numbers/modal_vectors.hpp"

#include "check.hpp"
#include "numbers/quadrature.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

Numbers random_matrix(int n, check::Random &random) {
  Numbers out(std::size_t(n) * std::size_t(n));
  for (double &x : out) x = random(0.0, 1.0) < 0.2 ? 0.0 : random(-1.0, 1.0);
  return out;
}
double entry(const Numbers &A, int n, int i, int j) { return A[std::size_t(i * n + j)]; }

}  // namespace

TEST("A B and S^T B: each number is one sum in ascending order, whatever the size") {
  check::Random random{4};
  for (int n : {1, 2, 3, 4, 7, 15, 16, 17, 23, 40}) {
    const Numbers A = random_matrix(n, random), B = random_matrix(n, random);
    Numbers C(A.size());
    product(n, A, B, C);
    bool same = true;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0.0;
        for (int k = 0; k < n; ++k) sum += entry(A, n, i, k) * entry(B, n, k, j);
        same = same && check::same_bits(entry(C, n, i, j) + 0.0, sum + 0.0);
      }
    CHECK(same);
    Numbers symmetric = A;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        symmetric[std::size_t(i * n + j)] = entry(A, n, i, j) + entry(A, n, j, i);
    Numbers square(A.size());
    symmetric_product(n, symmetric, symmetric, square);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0.0;
        for (int k = 0; k < n; ++k) sum += entry(symmetric, n, k, i) * entry(symmetric, n, k, j);
        CHECK_NEAR(entry(square, n, i, j), sum, 1e-14 * n);
      }
  }
}

TEST("an inner product of one robot has the digits of one in a pack") {
  check::Random random{5};
  for (int n : {1, 4, 5, 9}) {
    Numbers x(std::size_t(padded(n)), 0.0), y(x);
    std::vector<Lanes> packed_x, packed_y;
    for (int k = 0; k < n; ++k) {
      x[std::size_t(k)] = random(-1.0, 1.0), y[std::size_t(k)] = random(-1.0, 1.0);
      packed_x.push_back(x[std::size_t(k)]), packed_y.push_back(y[std::size_t(k)]);
    }
    CHECK(
        check::same_bits(dot(n, x.data(), y.data()), dot(n, packed_x.data(), packed_y.data())[2]));
  }
}

TEST("Legendre's polynomials, also of degree 0 alone") {
  double value[4] = {}, first[4] = {}, second[4] = {};
  legendre(0.3, 0, value, first, second);
  CHECK(value[0] == 1.0 && value[1] == 0.0 && first[0] == 0.0);
  legendre(0.3, 3, value, first, second);
  CHECK_NEAR(value[3], 0.5 * (5.0 * 0.027 - 3.0 * 0.3), 1e-15);
  CHECK_NEAR(first[3], 0.5 * (15.0 * 0.09 - 3.0), 1e-15);
  CHECK_NEAR(second[3], 15.0 * 0.3, 1e-15);
}
