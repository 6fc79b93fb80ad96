#include "numbers/quadrature.hpp"

#include <array>
#include <mutex>

#include "numbers/scalars.hpp"

namespace flexura {
namespace {

GaussRule computed_gauss(int count) {
  GaussRule rule;
  rule.u.resize(std::size_t(count)), rule.weight.resize(std::size_t(count));
  std::vector<double> value(std::size_t(count) + 1), first(value.size()), second(value.size());
  for (int k = 0; k < count; ++k) {
    double sine, u;
    sincos(3.14159265358979323846 * (double(count - k) - 0.25) / (count + 0.5), sine, u);
    for (int turn = 0; turn < 8;
         ++turn) {  // Newton's method, quadratic from a start that is good to 1 %
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

// l_j(u) = weight_j sum_n (2 n + 1)/2 P_n(u_j) P_n(u), n < P; int_-1^u P_n = (P_(n+1) - P_(n-1)) /
// (2 n + 1), of P_0: P_1 + P_0.
std::vector<double> lagrange_integrals(const GaussRule &rule) {
  const std::size_t P = rule.u.size();
  std::vector<double> out((P + 1) * P, 0.0), value(P + 1), first(P + 1), second(P + 1);
  for (std::size_t j = 0; j < P; ++j) {
    legendre(rule.u[j], int(P), value.data(), first.data(), second.data());
    for (std::size_t n = 0; n < P; ++n) {
      const double part = 0.5 * rule.weight[j] * value[n];
      out[(n + 1) * P + j] += part;
      if (n == 0)
        out[j] += part;
      else
        out[(n - 1) * P + j] -= part;
    }
  }
  return out;
}

LineRule computed_line(int P) {
  LineRule out;
  const std::size_t size = std::size_t(P);
  const GaussRule &points = gauss(P), &along = gauss(P + 2);
  out.u = points.u, out.weight = points.weight, out.integrals = lagrange_integrals(points);
  out.tip.resize(size), out.moment.assign(size, 0.0), out.W.assign(size * size, 0.0);
  line_weights(out, 1.0, 0.5, out.tip.data());
  std::vector<double> w(size);
  for (std::size_t k = 0; k < along.u.size(); ++k) {
    line_weights(out, along.u[k], 0.5, w.data());
    const double dm = 0.5 * along.weight[k];
    for (std::size_t j = 0; j < size; ++j) {
      out.moment[j] += dm * w[j];
      for (std::size_t l = 0; l < size; ++l) out.W[j * size + l] += dm * w[j] * w[l];
    }
  }
  return out;
}

// Entry `count` of a table that is computed entry by entry, each once.
template <class Entry, int MOST, class Compute>
const Entry &once(int count, Compute compute) {
  static std::array<Entry, MOST + 1> table;
  static std::array<std::once_flag, MOST + 1> made;
  const std::size_t at = std::size_t(count);
  std::call_once(made.at(at), [&] { table[at] = compute(count); });
  return table[at];
}

}  // namespace

const GaussRule &gauss(int count) {
  return once<GaussRule, MOST_POINTS + 2>(count, computed_gauss);
}

const LineRule &line_rule(int P) { return once<LineRule, MOST_POINTS>(P, computed_line); }

void line_weights(const LineRule &rule, double u, double scale, double *w) {
  const std::size_t P = rule.u.size();
  double value[MOST_POINTS + 1], first[MOST_POINTS + 1], second[MOST_POINTS + 1];
  legendre(u, int(P), value, first, second);
  for (std::size_t j = 0; j < P; ++j) w[j] = 0.0;
  for (std::size_t n = 0; n <= P; ++n)
    for (std::size_t j = 0; j < P; ++j) w[j] += scale * rule.integrals[n * P + j] * value[n];
}

}  // namespace flexura
