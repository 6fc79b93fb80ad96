// Short explicit steps for robots under a sampled controller, where every tick begins anew: Ralston's third order with an error
// estimate of second order (1962, Math. Comp. 16), three passes a step, and Cash and Karp's fifth with one of fourth (1990, ACM TOMS 16), six.
#pragma once
#include "implicit.hpp"

namespace flexura {

struct Tableau {
  const char *name;
  int stages;
  double order, stable;   // stable: longest step times the highest angular frequency
  double A[6][6], C[6];   // stages
  double b[6], error[6];  // the step; its error estimate
};

namespace pairs {
constexpr Tableau RALSTON{
    "explicit-3", 3, 3.0, 1.55,
    {{0.0}, {1.0 / 2}, {0.0, 3.0 / 4}},
    {0.0, 1.0 / 2, 3.0 / 4},
    {2.0 / 9, 1.0 / 3, 4.0 / 9},
    {2.0 / 9, 1.0 / 3 - 1.0, 4.0 / 9},
};
constexpr Tableau CASH_KARP{
    "explicit-5", 6, 5.0, 1.0,
    {{0.0},
     {1.0 / 5},
     {3.0 / 40, 9.0 / 40},
     {3.0 / 10, -9.0 / 10, 6.0 / 5},
     {-11.0 / 54, 5.0 / 2, -70.0 / 27, 35.0 / 27},
     {1631.0 / 55296, 175.0 / 512, 575.0 / 13824, 44275.0 / 110592, 253.0 / 4096}},
    {0.0, 1.0 / 5, 3.0 / 10, 3.0 / 5, 1.0, 7.0 / 8},
    {37.0 / 378, 0.0, 250.0 / 621, 125.0 / 594, 0.0, 512.0 / 1771},
    {37.0 / 378 - 2825.0 / 27648, 0.0, 250.0 / 621 - 18575.0 / 48384, 125.0 / 594 - 13525.0 / 55296, -277.0 / 14336, 512.0 / 1771 - 1.0 / 4},
};
}  // namespace pairs

template <class Real> class Pair : public Method<Real> {
 public:
  static constexpr int RENEW = 256;  // steps between two looks at the highest frequency

  Pair(Course<Real> &course, const Tableau &which)
      : Method<Real>(course), tableau(which), K(which.stages, course.size), other(padded(course.size), Real(0.0)), ending(other) {}
  const char *name() const override { return tableau.name; }

  void begin(const Real &which, const Real &t) override {
    slope(which, t, c.z.data());
    Real due = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(which, k) > 0.0 && age[std::size_t(k)] < 0) set_lane(due, k, 1.0);
    look(due);
  }

  double fit(int k, double wish, double left, double ahead) override {
    return Method<Real>::fit(k, std::fmin(wish, lane(longest, k)), left, ahead);
  }
  double restart(int k, double wish, bool first) override { return first ? std::fmin(wish, 0.02 * lane(longest, k)) : wish; }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    if (worst(stale) > 0.0) slope(stale, t, c.z.data());
    Real *znew = c.znew.data();
    for (int s = 1; s < tableau.stages; ++s) {
      K.sum(c.z.data(), h, tableau.A[s], s, znew);
      c.slope(smaller(t + h * tableau.C[s], last), znew, K[s]);
    }
    K.sum(c.z.data(), h, tableau.b, tableau.stages, znew);
    c.acts.at(smaller(t + h, last));
    c.acts.prescribe(znew, znew + c.n);
    K.sum(nullptr, h, tableau.error, tableau.stages, c.error.data());
    return c.weights.norm(c.error.data(), znew);
  }

  void accept(const Real &which) override {
    const Real one = 1.0;
    take(which, &one, &stale, 1);
    Real due = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(which, k) > 0.0 && ++age[std::size_t(k)] >= RENEW) set_lane(due, k, 1.0);
    if (worst(due) > 0.0) take(which, c.znew.data(), c.z.data(), c.size), look(due);
  }

  void prepare(const Real &t, const Real &h, const Real &last) override {
    std::copy(c.znew.begin(), c.znew.begin() + c.size, other.begin());
    c.slope(smaller(t + h, last), other.data(), ending.data());
  }

  // A quintic of positions, rates and accelerations at both ends; accounts by a cubic.
  void between(const Real &h, const Real &x, Real *state) override {
    const int n = c.n;
    const Real *z = c.z.data(), *znew = c.znew.data(), inverse = 1.0 / h;
    for (int k = 0; k < n; ++k) {
      Real y, v;
      quintic<Real>(x, znew[k] - z[k], h * z[n + k], h * znew[n + k], h * h * K[0][n + k], h * h * ending[std::size_t(n + k)], y, v);
      state[k] = z[k] + y, state[n + k] = v * inverse;
    }
    for (int k = 2 * n; k < c.size; ++k) {
      const Real rise = znew[k] - z[k], f0 = h * K[0][k], f1 = h * ending[std::size_t(k)];
      state[k] = z[k] + x * (f0 + x * (3.0 * rise - 2.0 * f0 - f1 + x * (f0 + f1 - 2.0 * rise)));
    }
  }

 protected:
  double power() const override { return tableau.order; }

 private:
  using Method<Real>::c;
  const Tableau &tableau;
  Stages<Real> K;
  std::vector<Real> other, ending;
  Real stale = Real(0.0);  // lanes whose first slope is that of the step before
  Real longest = Real(std::numeric_limits<double>::infinity());
  std::array<int, LanesOf<Real>::value> age = all_new();  // steps since the last look; below 0: none yet

  static std::array<int, LanesOf<Real>::value> all_new() {
    std::array<int, LanesOf<Real>::value> x;
    x.fill(-1);
    return x;
  }

  // The first slope of the lanes `which` at z.
  void slope(const Real &which, const Real &t, Real *z) {
    std::copy(z, z + c.size, other.data());
    std::vector<Real> &dz = ending;
    c.slope(t, other.data(), dz.data());
    take(which, other.data(), z, c.size);
    take(which, dz.data(), K[0], c.size);
    const Real none = 0.0;
    take(which, &none, &stale, 1);
  }

  // The longest stable step where the lanes `due` are.
  void look(const Real &due) {
    if (!(worst(due) > 0.0)) return;
    const Real *q = c.z.data(), *v = q + c.n;
    const Real limit = tableau.stable / c.plant.fastest(q, c.acts.pass(q, v, q, v, Real(0.0), Real(0.0)));
    take(due, &limit, &longest, 1);
    for (int k = 0; k < this->LANES; ++k)
      if (lane(due, k) > 0.0) age[std::size_t(k)] = 0;
  }
};

// The method that takes the fewest passes between two ticks, T apart: by what is stable for the highest angular frequency `fast`, and
// by the length of step that the tolerance allows along the slowest mode of bending, `slow` [rad/s].
inline const char *quickest_between_ticks(double T, double fast, double slow, double rtol) {
  struct Choice {
    const char *name;
    double passes, longest;
  };
  const double pace = 1.0 / std::fmax(slow, 1e-3), stable = 1.0 / std::fmax(fast, 1e-300);
  const Choice all[] = {
      {"explicit-3", 3.0, std::fmin(pairs::RALSTON.stable * stable, std::cbrt(100.0 * rtol) * pace)},
      {"explicit-5", 6.0, std::fmin(pairs::CASH_KARP.stable * stable, std::pow(4000.0 * rtol, 0.2) * pace)},
      {"explicit", 13.0, Explicit<double>::STABLE * stable},
      {"implicit", 12.0, 50.0 * std::sqrt(std::sqrt(rtol)) * pace},
  };
  const Choice *best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Choice &one : all) {
    const double passes = one.passes * std::ceil(T / one.longest);
    if (passes < least) least = passes, best = &one;
  }
  return best ? best->name : "implicit";
}

}  // namespace flexura
