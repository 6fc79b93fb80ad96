// Gauss points and the polynomials through them: integrals along a link, of products along a link,
// and values at any place.
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
    value[n + 1] =
        (double(2 * n + 1) / (n + 1)) * u * value[n] - (double(n) / (n + 1)) * value[n - 1];
    first[n + 1] = first[n - 1] + double(2 * n + 1) * value[n];
    second[n + 1] = second[n - 1] + double(2 * n + 1) * first[n];
  }
}

// What depends on a number of points alone is computed once, when it is asked for first, by
// whichever thread that is.
constexpr int MOST_POINTS = 48;

// Gauss-Legendre points u (ascending) and weights on [-1, 1]; 1 <= count <= MOST_POINTS.
struct GaussRule {
  std::vector<double> u, weight;
};
const GaussRule &gauss(int count);

// The weights w_j of a line's place (13) as a function of the place, of a line with P Gauss points.
struct LineRule {
  std::vector<double> u, weight;  // (P) of the points, on [-1, 1]
  // (P + 1, P): the integral of Lagrange's polynomial l_j through the points, as a sum of
  // Legendre's polynomials: int_-1^u l_j = sum_n integrals[n, j] P_n(u) (exact: the l_j are
  // orthogonal under the rule itself).
  std::vector<double> integrals;
  std::vector<double> tip;  // (P) w of the tip of a line of length 1
  std::vector<double> moment,
      W;  // (P), (P, P): int w dm and int w w^T dm (14) of a uniform line of length 1 and mass 1
};
const LineRule &line_rule(int P);

// w (P) at u of a line that is `scale` times as long as [-1, 1].
void line_weights(const LineRule &rule, double u, double scale, double *w);

}  // namespace flexura
