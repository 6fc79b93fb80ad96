// The method "explicit": Runge and Kutta's steps of order 8 with an interpolant of order 7
// (DOP853), no longer than the fastest mode of the robot lets them be (83). Under a sampled
// controller with short ticks, a step of order 3 or 5 a tick (`embedded_pairs.hpp`).
#pragma once
#include "integration/method.hpp"
#include "integration/runge_kutta/dop853_coefficients.hpp"

namespace flexura {

// The slopes of a step's stages, and sums of them.
template <class Real>
class Stages {
 public:
  Stages(int count, int size_)
      : size(size_),
        width(padded(size_)),
        data(static_cast<std::size_t>(count * padded(size_)), Real(0.0)) {}
  Real *operator[](int s) { return data.data() + static_cast<std::size_t>(s * width); }

  // out = z + h sum_j weights_j K_j over the first `count` stages; z null: nothing.
  void sum(const Real *z, const Real &h, const double *weights, int count, Real *out) {
    for (int k = 0; k < size; ++k) out[k] = Real(0.0);
    for (int j = 0; j < count; ++j) {
      if (weights[j] == 0.0) continue;
      const Real w = weights[j], *K = (*this)[j];
      for (int k = 0; k < size; ++k) out[k] += w * K[k];
    }
    if (z)
      for (int k = 0; k < size; ++k) out[k] = z[k] + h * out[k];
    else
      for (int k = 0; k < size; ++k) out[k] = h * out[k];
  }

 private:
  int size, width;
  std::vector<Real> data;
};

template <class Real>
class Explicit : public Method<Real> {
 public:
  static constexpr double STABLE = 5.3;  // longest step times the highest angular frequency
  static constexpr int RENEW = 32;       // steps between two looks at that frequency

  explicit Explicit(Integration<Real> &integration)
      : Method<Real>(integration),
        K(16, integration.size),
        other(padded(integration.size), Real(0.0)) {
    for (auto &row : F) row.assign(padded(integration.size), Real(0.0));
  }
  const char *name() const override { return "explicit"; }

  void begin(const Real &which, const Real &t) override {
    take(which, c.z.data(), c.znew.data(), c.size);
    c.slope(t, c.znew.data(), other.data());
    take(which, c.znew.data(), c.z.data(), c.size);
    take(which, other.data(), K[0], c.size);
    Real due = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(which, k) > 0.0 && age[k] < 0) set_lane(due, k, 1.0);
    look(due);
  }

  double fit(int k, double wish, double left, double ahead) override {
    const double h = Method<Real>::fit(k, std::fmin(wish, lane(longest, k)), left, ahead);
    return 0.7 * h < ahead && ahead < h
               ? ahead
               : h;  // a full step to an output costs less than the interpolant's three stages
  }
  double restart(int k, double wish, bool first) override {
    return first ? std::fmin(wish, 0.02 * lane(longest, k)) : wish;
  }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    Real *znew = c.znew.data();
    for (int s = 1; s < 13; ++s) {
      K.sum(c.z.data(), h, dop853::A[s], s, znew);
      c.slope(smaller(t + h * dop853::C[s], last), znew, K[s]);
    }
    K.sum(nullptr, h, dop853::E3, 13, other.data());
    const Real e3 = c.weights.norm(other.data(), znew);
    K.sum(nullptr, h, dop853::E5, 13, c.error.data());
    const Real e5 = c.weights.norm(c.error.data(), znew);
    const Real both = root(e5 * e5 + 0.01 * (e3 * e3));
    return choose_less(both, Real(1e-150), both, e5 * (e5 / both));
  }

  void accept(const Real &which) override {
    take(which, K[12], K[0], c.size);
    Real due = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(which, k) > 0.0 && ++age[k] >= RENEW) set_lane(due, k, 1.0);
    if (worst(due) > 0.0) take(which, c.znew.data(), c.z.data(), c.size), look(due);
  }

  void prepare(const Real &t, const Real &h, const Real &last) override {
    for (int s = 0; s < 3; ++s) {
      K.sum(c.z.data(), h, dop853::AX[s], 13 + s, other.data());
      c.slope(smaller(t + h * dop853::CX[s], last), other.data(), K[13 + s]);
    }
    for (int k = 0; k < c.size; ++k) {
      const Real rise = c.znew[k] - c.z[k], start = h * K[0][k], end = h * K[12][k];
      F[0][k] = rise, F[1][k] = start - rise, F[2][k] = 2.0 * rise - (end + start);
    }
    for (int r = 0; r < 4; ++r) K.sum(nullptr, h, dop853::D[r], 16, F[3 + r].data());
  }

  void between(const Real &, const Real &x, Real *state) override {
    const Real rest = 1.0 - x;
    for (int k = 0; k < c.size; ++k) {
      Real sum = 0.0;
      for (int r = 6; r >= 0; --r) sum = (sum + F[r][k]) * (r % 2 == 0 ? x : rest);
      state[k] = c.z[k] + sum;
    }
  }

 protected:
  double power() const override { return 8.0; }

 private:
  using Method<Real>::c;
  Stages<Real> K;
  std::array<std::vector<Real>, 7> F;
  std::vector<Real> other;
  Real longest = Real(std::numeric_limits<double>::infinity());
  std::array<int, LanesOf<Real>::value> age =
      all_new();  // steps since the last look; below 0: none yet

  static std::array<int, LanesOf<Real>::value> all_new() {
    std::array<int, LanesOf<Real>::value> x;
    x.fill(-1);
    return x;
  }

  // The longest stable step (83) where the lanes `due` are.
  void look(const Real &due) {
    if (!(worst(due) > 0.0)) return;
    const Real *q = c.z.data(), *v = q + c.n;
    const Real limit = STABLE / c.plant.fastest(q, c.acts.pass(q, v, q, v, Real(0.0), Real(0.0)));
    take(due, &limit, &longest, 1);
    for (int k = 0; k < this->LANES; ++k)
      if (lane(due, k) > 0.0) age[k] = 0;
  }
};

extern template class Explicit<double>;
extern template class Explicit<Pack<4>>;

}  // namespace flexura
