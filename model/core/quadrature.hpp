// Gauss points and the polynomials through them: integrals along a link, of products along a link, and values at any place.
#pragma once
#include <vector>

namespace flexura {

// Legendre's polynomials P_0 ... P_degree at u, with their first and second derivatives.
template <class Real>
inline void legendre(const Real &u, int degree, Real *value, Real *first, Real *second) {
  value[0] = 1.0, first[0] = 0.0, second[0] = 0.0;
  if (degree == 0) return;
  value[1] = u, first[1] = 1.0, second[1] = 0.0;
  for (int n = 1; n < degree; ++n) {
    value[n + 1] = (double(2 * n + 1) / (n + 1)) * u * value[n] - (double(n) / (n + 1)) * value[n - 1];
    first[n + 1] = first[n - 1] + double(2 * n + 1) * value[n];
    second[n + 1] = second[n - 1] + double(2 * n + 1) * first[n];
  }
}

// Gauss-Legendre points u (ascending) and weights on [-1, 1].
struct GaussRule {
  std::vector<double> u, weight;
};
GaussRule gauss(int count);

// Integrals of Lagrange's polynomials l_j through the points of a rule, in the variable u and as sums of Legendre's polynomials:
// int_-1^u l_j = sum_n integral[n][j] P_n(u), n = 0 ... count (exact: the l_j are orthogonal under the rule itself).
std::vector<std::vector<double>> lagrange_integrals(const GaussRule &rule);

}  // namespace flexura
