// Explicit steps of order 3 or 5 for runs under a sampled controller, whose ticks are shorter than
// the steps of DOP853 would be: nothing is looked at twice, so that a step takes 3 or 6 passes
// where DOP853 takes 13 after a jump. Ralston 3(2), and 5(4) of Cash and Karp (1990, ACM Trans.
// Math. Softw. 16, 201-222).
#pragma once
#include "integration/runge_kutta/dop853.hpp"

namespace flexura {

struct EmbeddedPair {
  const char *name;
  int stages;
  double order, stable;        // stable: longest step times the highest angular frequency
  double A[7][6], C[7], E[6];  // the row after the last stage: the step's end
};

constexpr EmbeddedPair PAIR_3 = {
    "explicit-3",
    3,
    3.0,
    1.55,
    {{0.0}, {1.0 / 2}, {0.0, 3.0 / 4}, {2.0 / 9, 1.0 / 3, 4.0 / 9}},
    {0.0, 1.0 / 2, 3.0 / 4, 1.0},
    {1.0 / 36, -3.0 / 36, 2.0 / 36},  // from a member of second order, off by z^3/48 for y' = z y
};
constexpr EmbeddedPair PAIR_5 = {
    "explicit-5",
    6,
    5.0,
    1.0,
    {{0.0},
     {1.0 / 5},
     {3.0 / 40, 9.0 / 40},
     {3.0 / 10, -9.0 / 10, 6.0 / 5},
     {-11.0 / 54, 5.0 / 2, -70.0 / 27, 35.0 / 27},
     {1631.0 / 55296, 175.0 / 512, 575.0 / 13824, 44275.0 / 110592, 253.0 / 4096},
     {37.0 / 378, 0.0, 250.0 / 621, 125.0 / 594, 0.0, 512.0 / 1771}},
    {0.0, 1.0 / 5, 3.0 / 10, 3.0 / 5, 1.0, 7.0 / 8, 1.0},
    {37.0 / 378 - 2825.0 / 27648, 0.0, 250.0 / 621 - 18575.0 / 48384, 125.0 / 594 - 13525.0 / 55296,
     -277.0 / 14336, 512.0 / 1771 - 1.0 / 4},
};

template <class Real>
class EmbeddedPairSteps : public Method<Real> {
 public:
  EmbeddedPairSteps(Integration<Real> &integration, const EmbeddedPair &coefficients)
      : Method<Real>(integration),
        pair(coefficients),
        K(coefficients.stages + 1, integration.size) {}
  const char *name() const override { return pair.name; }

  void begin(const Real &which, const Real &t) override {
    c.acts.at(t);
    c.acts.prescribe(c.z.data(), c.z.data() + c.n);
    Real due = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(which, k) > 0.0 && !known[std::size_t(k)])
        set_lane(due, k, 1.0), known[std::size_t(k)] = true;
    if (!(worst(due) > 0.0)) return;
    const Real *q = c.z.data(), *v = q + c.n;
    const Real limit =
        pair.stable / c.plant.fastest(q, c.acts.pass(q, v, q, v, Real(0.0), Real(0.0)));
    take(due, &limit, &longest, 1);
  }

  double fit(int k, double wish, double left, double ahead) override {
    return Method<Real>::fit(k, std::fmin(wish, lane(longest, k)), left, ahead);
  }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    Real *znew = c.znew.data();
    for (int s = 0; s < pair.stages; ++s) {
      K.sum(c.z.data(), h, pair.A[s], s, znew);
      c.slope(smaller(t + h * pair.C[s], last), znew, K[s]);
    }
    K.sum(c.z.data(), h, pair.A[pair.stages], pair.stages, znew);
    c.acts.at(smaller(t + h, last));
    c.acts.prescribe(znew, znew + c.n);
    K.sum(nullptr, h, pair.E, pair.stages, c.error.data());
    return c.weights.norm(c.error.data(), znew);
  }

  void accept(const Real &) override {}

  void prepare(const Real &t, const Real &h, const Real &last) override {
    std::vector<Real> end = c.znew;
    c.slope(smaller(t + h, last), end.data(), K[pair.stages]);
  }

  void between(const Real &h, const Real &x, Real *state) override {
    for (int k = 0; k < c.size; ++k) {
      const Real rise = c.znew[k] - c.z[k], f0 = h * K[0][k], f1 = h * K[pair.stages][k];
      state[k] = c.z[k] + x * (f0 + x * (3.0 * rise - 2.0 * f0 - f1 + x * (f0 + f1 - 2.0 * rise)));
    }
  }

 protected:
  double power() const override { return pair.order; }

 private:
  using Method<Real>::c;
  const EmbeddedPair &pair;
  Stages<Real> K;
  Real longest = Real(std::numeric_limits<double>::infinity());
  std::array<bool, LanesOf<Real>::value> known{};
};

extern template class EmbeddedPairSteps<double>;

}  // namespace flexura
