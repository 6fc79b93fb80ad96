#include "quadrature.hpp"

#include "real.hpp"

namespace flexura {

GaussRule gauss(int count) {
  GaussRule rule;
  rule.u.resize(std::size_t(count)), rule.weight.resize(std::size_t(count));
  std::vector<double> value(std::size_t(count) + 1), first(value.size()), second(value.size());
  for (int k = 0; k < count; ++k) {
    double sine, u;
    sincos(3.14159265358979323846 * (double(count - k) - 0.25) / (count + 0.5), sine, u);
    for (int turn = 0; turn < 8; ++turn) {  // Newton's method, quadratic from a start that is good to 1 %
      legendre(u, count, value.data(), first.data(), second.data());
      u -= value[std::size_t(count)] / first[std::size_t(count)];
    }
    legendre(u, count, value.data(), first.data(), second.data());
    const double slope = first[std::size_t(count)];
    rule.u[std::size_t(k)] = u;
    rule.weight[std::size_t(k)] = 2.0 / ((1.0 - u * u) * slope * slope);
  }
  return rule;
}

std::vector<std::vector<double>> lagrange_integrals(const GaussRule &rule) {
  const std::size_t count = rule.u.size();
  std::vector<std::vector<double>> out(count + 1, std::vector<double>(count, 0.0));
  std::vector<double> value(count + 1), first(count + 1), second(count + 1);
  for (std::size_t j = 0; j < count; ++j) {
    legendre(rule.u[j], int(count), value.data(), first.data(), second.data());
    // l_j(u) = weight_j sum_n (2 n + 1)/2 P_n(u_j) P_n(u), n < count; int_-1^u P_n = (P_(n+1) - P_(n-1)) / (2 n + 1), of P_0: P_1 + P_0
    for (std::size_t n = 0; n < count; ++n) {
      const double part = 0.5 * rule.weight[j] * value[n];
      out[n + 1][j] += part;
      if (n == 0) out[0][j] += part;
      else out[n - 1][j] -= part;
    }
  }
  return out;
}

}  // namespace flexura
