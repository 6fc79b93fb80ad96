// The method "implicit": ESDIRK4(3)6L[2]SA of Kennedy and Carpenter (2003, Appl. Numer. Math. 44), L-stable, each stage solved by passes
// that hold stiffness, damping, gains and friction implicitly. A pass costs what an explicit one costs, and two or three make a
// stage whatever the stiffness: steps follow the motion, not the fastest mode.
#pragma once
#include "explicit.hpp"

namespace flexura {

namespace esdirk {
constexpr double GAMMA = 0.25;
constexpr double A[6][6] = {
    {0.0},
    {1.0 / 4, 1.0 / 4},
    {8611.0 / 62500, -1743.0 / 31250, 1.0 / 4},
    {5012029.0 / 34652500, -654441.0 / 2922500, 174375.0 / 388108, 1.0 / 4},
    {15267082809.0 / 155376265600, -71443401.0 / 120774400, 730878875.0 / 902184768, 2285395.0 / 8070912, 1.0 / 4},
    {82889.0 / 524892, 0.0, 15625.0 / 83664, 69875.0 / 102672, -2260.0 / 8211, 1.0 / 4},
};
constexpr double C[6] = {0.0, 1.0 / 2, 83.0 / 250, 31.0 / 50, 17.0 / 20, 1.0};
constexpr double E[6] = {  // the last row of A less the weights of third order
    82889.0 / 524892 - 4586570599.0 / 29645900160, 0.0, 15625.0 / 83664 - 178811875.0 / 945068544,
    69875.0 / 102672 - 814220225.0 / 1159782912, -2260.0 / 8211 + 3700637.0 / 11593932, 1.0 / 4 - 61727.0 / 225920,
};
}  // namespace esdirk

template <class Real> class Implicit : public Method<Real> {
 public:
  static constexpr double TIGHT = 0.02;  // of the tolerance: what may be left of a stage
  static constexpr int MOST = 10;        // passes of a stage
  static constexpr double CAUTION = 2.0; // errors of steps add up over a run more than those of order 8 do

  explicit Implicit(Course<Real> &course)
      : Method<Real>(course), K(6, course.size), ys(padded(course.n), Real(0.0)), vs(ys), a(ys), next(ys),
        other(padded(course.size), Real(0.0)) {}
  const char *name() const override { return "implicit"; }

  void begin(const Real &which, const Real &t) override {
    take(which, c.z.data(), c.znew.data(), c.size);
    c.slope(t, c.znew.data(), other.data());
    take(which, c.znew.data(), c.z.data(), c.size);
    take(which, other.data(), K[0], c.size);
  }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    const int n = c.n;
    Real *znew = c.znew.data();
    Real refused = 0.0;
    if (worst(steep) > 0.0) c.acts.learn(steep, t, c.z.data(), c.z.data() + n), steep = Real(0.0);
    std::copy(K[0] + n, K[0] + 2 * n, a.data());
    for (int s = 1; s < 6; ++s) {
      known(h, s);
      refused = larger(refused, solve(smaller(t + h * esdirk::C[s], last), h * esdirk::GAMMA));
      bool none = true;
      for (int k = 0; k < this->LANES; ++k) none = none && lane(refused, k) != 0.0;
      if (none) return refused;
      std::copy(znew + n, znew + 2 * n, K[s]);
      std::copy(a.begin(), a.begin() + n, K[s] + n);
      c.rates(znew, znew + n, K[s] + 2 * n);
    }
    for (int k = 2 * n; k < c.size; ++k) {
      Real sum = 0.0;
      for (int j = 0; j < 6; ++j) sum += esdirk::A[5][j] * K[j][k];
      znew[k] = c.z[k] + h * sum;
    }
    K.sum(nullptr, h, esdirk::E, 6, c.error.data());
    return larger(refused, CAUTION * c.weights.norm(c.error.data(), znew));
  }

  void accept(const Real &which) override { take(which, K[5], K[0], c.size); }

  void prepare(const Real &, const Real &, const Real &) override {}

  // By cubics through states and slopes at both ends. (A quintic of the positions would take the accelerations in, which of modes
  // that the step does not resolve say nothing.)
  void between(const Real &h, const Real &x, Real *state) override {
    for (int k = 0; k < c.size; ++k) {
      const Real rise = c.znew[k] - c.z[k], f0 = h * K[0][k], f1 = h * K[5][k];
      state[k] = c.z[k] + x * (f0 + x * (3.0 * rise - 2.0 * f0 - f1 + x * (f0 + f1 - 2.0 * rise)));
    }
  }

 protected:
  double power() const override { return 4.0; }

 private:
  using Method<Real>::c;
  Stages<Real> K;
  std::vector<Real> ys, vs, a, next, other;
  Real steep = 0.0;  // 1: a stage did not converge, perhaps for a steep function of the caller's

  // What stage s knows of its state: with the accelerations a that it looks for, ys + g^2 h^2 a and vs + g h a.
  void known(const Real &h, int s) {
    const int n = c.n;
    K.sum(c.z.data(), h, esdirk::A[s], s, other.data());
    for (int k = 0; k < n; ++k) vs[k] = other[n + k], ys[k] = other[k] + (h * esdirk::GAMMA) * vs[k];
  }

  // The state of a stage from its accelerations, into c.znew.
  void place(const Real &gh) {
    const int n = c.n;
    for (int k = 0; k < n; ++k) c.znew[k] = ys[k] + (gh * gh) * a[k], c.znew[n + k] = vs[k] + gh * a[k];
    c.acts.prescribe(c.znew.data(), c.znew.data() + n);
  }

  // Passes until a, which comes as a guess, moves no more; a lane that is done keeps its numbers.
  // REFUSED where they did not converge, what is not a number where the equations gave that; else 0.
  Real solve(const Real &time, const Real &gh) {
    const int n = c.n;
    Real *q = c.znew.data(), *v = q + n;
    Real open = 1.0, missed = 0.0, before = 1e300;
    c.acts.at(time);
    for (int k = 2 * n; k < c.size; ++k) c.error[k] = Real(0.0);
    for (int turn = 0; turn < MOST; ++turn) {
      place(gh);
      c.acts.load_stage(q, v, turn == 0);
      c.plant.accelerate(c.acts.pass(q, v, ys.data(), vs.data(), gh * gh, gh), next.data(), c.acts.reaction.data());
      ++c.passes;
      for (int k = 0; k < n; ++k) {
        const Real step = gh * (next[k] - a[k]);
        c.error[k] = gh * step, c.error[n + k] = step;
      }
      const Real moved = c.weights.norm(c.error.data(), c.z.data());
      take(open, next.data(), a.data(), n);
      for (int k = 0; k < this->LANES; ++k) {
        if (lane(open, k) == 0.0) continue;
        const double m = lane(moved, k), rate = turn ? m / lane(before, k) : 1.0;
        const bool near = m < TIGHT || (turn && rate < 0.9 && m * rate / (1.0 - rate) < TIGHT);
        const bool far = !(m < 1e12) || (turn > 2 && rate > 0.9) || turn == MOST - 1;
        if (near || far) set_lane(open, k, 0.0);
        if (far && !near) set_lane(missed, k, std::isfinite(m) ? this->REFUSED : m - m), set_lane(steep, k, 1.0);
      }
      before = moved;
      if (worst(open) == 0.0) break;
    }
    place(gh);
    return missed;
  }
};

extern template class Implicit<double>;
extern template class Implicit<Pack<4>>;

}  // namespace flexura
