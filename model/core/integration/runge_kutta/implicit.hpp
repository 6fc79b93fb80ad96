// Implicit steps, each stage solved by passes that hold stiffness, damping, gains and friction
// implicitly (49). A pass costs what an explicit one costs, and one to three make a stage whatever
// the stiffness: steps follow the motion, not the fastest mode.
//
//   "implicit"     ESDIRK4(3)6L[2]SA of Kennedy and Carpenter (2003, Appl. Numer. Math. 44), order
//   4 "implicit-2"   TR-BDF2 of Hosea and Shampine (1996, Appl. Numer. Math. 20), order 2: for
//   steps that ticks keep short
//
// Both are L-stable.
#pragma once
#include "integration/runge_kutta/dop853.hpp"

namespace flexura {

struct DiagonallyImplicit {
  const char *name;
  int stages;
  double order, gamma;
  double A[6][6], C[6], E[6];  // E: the last row of A less the weights of the other order
};

constexpr DiagonallyImplicit ESDIRK_4 = {
    "implicit",
    6,
    4.0,
    0.25,
    {{0.0},
     {1.0 / 4, 1.0 / 4},
     {8611.0 / 62500, -1743.0 / 31250, 1.0 / 4},
     {5012029.0 / 34652500, -654441.0 / 2922500, 174375.0 / 388108, 1.0 / 4},
     {15267082809.0 / 155376265600, -71443401.0 / 120774400, 730878875.0 / 902184768,
      2285395.0 / 8070912, 1.0 / 4},
     {82889.0 / 524892, 0.0, 15625.0 / 83664, 69875.0 / 102672, -2260.0 / 8211, 1.0 / 4}},
    {0.0, 1.0 / 2, 83.0 / 250, 31.0 / 50, 17.0 / 20, 1.0},
    {82889.0 / 524892 - 4586570599.0 / 29645900160, 0.0, 15625.0 / 83664 - 178811875.0 / 945068544,
     69875.0 / 102672 - 814220225.0 / 1159782912, -2260.0 / 8211 + 3700637.0 / 11593932,
     1.0 / 4 - 61727.0 / 225920},
};
constexpr double BDF2_D = 0.29289321881345247560,
                 BDF2_W = 0.35355339059327376220;  // 1 - 1/sqrt 2, sqrt 2 / 4
constexpr DiagonallyImplicit TR_BDF2 = {
    "implicit-2",
    3,
    2.0,
    BDF2_D,
    {{0.0}, {BDF2_D, BDF2_D}, {BDF2_W, BDF2_W, BDF2_D}},
    {0.0, 2.0 * BDF2_D, 1.0},
    {BDF2_W - (1.0 - BDF2_W) / 3.0, BDF2_W - (3.0 * BDF2_W + 1.0) / 3.0, BDF2_D - BDF2_D / 3.0},
};

template <class Real>
class Implicit : public Method<Real> {
 public:
  static constexpr double TIGHT = 0.02;      // of the tolerance: what may be left of a stage
  static constexpr int NODES = 3;            // of a stage's guess
  static constexpr double FARTHER = 2.0;     // a step so much longer than the last one goes without
  static constexpr int MOST = 10, SLOW = 4;  // passes of a stage, at most; what is slow
  static constexpr double CAUTION =
      4.0;  // errors of steps add up over a run more than those of order 8 do
  static constexpr double OLDER =
      1.1;  // a contraction that was not measured again is taken for so much larger

  explicit Implicit(Integration<Real> &integration,
                    const DiagonallyImplicit &coefficients = ESDIRK_4)
      : Method<Real>(integration),
        s_(coefficients),
        K(coefficients.stages, integration.size),
        ys(padded(integration.n), Real(0.0)),
        vs(ys),
        a(ys),
        next(ys),
        other(padded(integration.size), Real(0.0)),
        reaction(integration.acts.reaction) {
    for (int s = 1; s < s_.stages; ++s)
      for (int j = first_node(s); j < last_node(s); ++j) {
        scale[s][j] = 1.0;
        for (int i = first_node(s); i < last_node(s); ++i)
          if (i != j) scale[s][j] /= s_.C[j] - s_.C[i];
      }
  }
  const char *name() const override { return s_.name; }

  void begin(const Real &which, const Real &t) override {
    take(which, c.z.data(), c.znew.data(), c.size);
    c.slope(t, c.znew.data(), other.data());
    take(which, c.znew.data(), c.z.data(), c.size);
    take(which, other.data(), K[0], c.size);
    steep = which, past = choose_less(Real(0.5), which, Real(0.0), past);
  }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    const int n = c.n;
    Real *znew = c.znew.data();
    Real refused = 0.0;
    if (worst(steep) > 0.0)
      c.acts.estimate_function_slopes(steep, t, c.z.data(), c.z.data() + n), steep = Real(0.0);
    for (int s = 1; s < s_.stages; ++s) {
      guess(h, s);
      known(h, s);
      if (!solve(smaller(t + h * s_.C[s], last), h * s_.gamma, refused)) return refused;
      std::copy(znew + n, znew + 2 * n, K[s]);
      std::copy(a.begin(), a.begin() + n, K[s] + n);
      c.rates(znew, znew + n, K[s] + 2 * n);
    }
    for (int k = 2 * n; k < c.size; ++k) {
      Real sum = 0.0;
      for (int j = 0; j < s_.stages; ++j) sum += s_.A[s_.stages - 1][j] * K[j][k];
      znew[k] = c.z[k] + h * sum;
    }
    K.sum(nullptr, h, s_.E, s_.stages, other.data());
    const Real solved = not_refused(refused);
    take(solved, other.data(), c.error.data(), c.size);
    made = h;
    return choose_less(Real(0.5), solved, CAUTION * c.weights.norm(other.data(), znew), refused);
  }

  void accept(const Real &which) override {
    take(which, K[s_.stages - 1], K[0], c.size);
    past = choose_less(Real(0.5), which, made, Real(0.0));
  }

  void prepare(const Real &, const Real &, const Real &) override {}

  // By cubics through states and slopes at both ends. (A quintic of the positions would take the
  // accelerations in, which of modes that the step does not resolve say nothing.)
  void between(const Real &h, const Real &x, Real *state) override {
    for (int k = 0; k < c.size; ++k) {
      const Real rise = c.znew[k] - c.z[k], f0 = h * K[0][k], f1 = h * K[s_.stages - 1][k];
      state[k] = c.z[k] + x * (f0 + x * (3.0 * rise - 2.0 * f0 - f1 + x * (f0 + f1 - 2.0 * rise)));
    }
  }

 protected:
  double power() const override { return s_.order; }

 private:
  using Method<Real>::c;
  const DiagonallyImplicit &s_;
  Stages<Real> K;
  std::vector<Real> ys, vs, a, next, other, reaction;
  Real steep = 0.0;  // 1: slopes of the caller's function are to be found (again): at the start, or
                     // as a stage was slow to converge
  double scale[6][6] = {};  // (stage, node): of Lagrange's polynomials of its guess
  Real made = 0.0,
       past = 0.0;         // length of the last step, and of the one whose stages K still holds
  Real contraction = 1.0;  // of what is left of a stage by a pass, as last measured

  // What stage s knows of its state (85): with the accelerations a that it looks for, ys + g^2 h^2
  // a and vs + g h a.
  void known(const Real &h, int s) {
    const int n = c.n;
    K.sum(c.z.data(), h, s_.A[s], s, other.data());
    for (int k = 0; k < n; ++k) vs[k] = other[n + k], ys[k] = other[k] + (h * s_.gamma) * vs[k];
  }

  // The stages whose accelerations give stage s a guess: the last ones before it, at most NODES;
  // the first stage takes the last step's, whose first one K does not hold any more.
  int last_node(int s) const { return s > 1 ? s : s_.stages; }
  int first_node(int s) const { return std::max(s > 1 ? 0 : 1, last_node(s) - NODES); }

  // A guess of the accelerations of stage s, into a: by the polynomial through those of its nodes.
  // The first stage takes the accelerations at its start where there is no last step, or a short
  // one.
  void guess(const Real &h, int s) {
    const int n = c.n, last = last_node(s), first = first_node(s);
    const Real none = choose_less(h, FARTHER * past, Real(0.0), Real(1.0));
    Real at = s_.C[s];
    if (s == 1) at = 1.0 + s_.C[1] * h / (past + none), past = Real(0.0);
    Real weight[6];
    for (int j = first; j < last; ++j) {
      weight[j] = scale[s][j];
      for (int i = first; i < last; ++i)
        if (i != j) weight[j] *= at - s_.C[i];
    }
    for (int k = n; k < 2 * n; ++k) {
      Real sum = 0.0;
      for (int j = first; j < last; ++j) sum += weight[j] * K[j][k];
      a[k - n] = s > 1 ? sum : choose_less(Real(0.5), none, K[0][k], sum);
    }
  }

  // The state of a stage from its accelerations, into c.znew.
  void place(const Real &gh) {
    const int n = c.n;
    for (int k = 0; k < n; ++k)
      c.znew[k] = ys[k] + (gh * gh) * a[k], c.znew[n + k] = vs[k] + gh * a[k];
    c.acts.prescribe(c.znew.data(), c.znew.data() + n);
  }

  // 1 for the robots that are not refused, else 0.
  Real not_refused(const Real &refused) const {
    Real out = 0.0;
    for (int k = 0; k < this->LANES; ++k)
      if (lane(refused, k) == 0.0) set_lane(out, k, 1.0);
    return out;
  }

  // Passes until a, which comes as a guess, moves no more. A robot that is done keeps its numbers,
  // reactions and forces too, and so does one that `refused` names: nothing depends on neighbours.
  // `refused` becomes REFUSED where passes did not converge, what is not a number where the
  // equations gave that. True: some robot goes on.
  bool solve(const Real &time, const Real &gh, Real &refused) {
    const int n = c.n;
    Real *q = c.znew.data(), *v = q + n;
    Real open = not_refused(refused), before = 1e300;
    c.acts.at(time);
    std::fill(other.begin(), other.end(), Real(0.0));
    for (int turn = 0; worst(open) > 0.0; ++turn) {
      place(gh);
      c.acts.load_stage(open, q, v, turn == 0);
      c.plant.accelerate(c.acts.pass(q, v, ys.data(), vs.data(), gh * gh, gh), next.data(),
                         reaction.data());
      ++c.passes;
      for (int k = 0; k < n; ++k) {
        const Real step = gh * (next[k] - a[k]);
        other[k] = gh * step, other[n + k] = step;
      }
      const Real moved = c.weights.norm(other.data(), c.z.data());
      take(open, next.data(), a.data(), n);
      take(open, reaction.data(), c.acts.reaction.data(), c.plant.joints);
      take(open, other.data(), c.error.data(), c.size);
      for (int k = 0; k < this->LANES; ++k) {
        if (lane(open, k) == 0.0) continue;
        const double m = lane(moved, k), known_rate = lane(contraction, k),
                     rate = turn ? m / lane(before, k) : known_rate;
        const bool near = m < TIGHT || (rate < 0.9 && m * rate / (1.0 - rate) < TIGHT);
        const bool far = !(m < 1e12) || (turn > 2 && rate > 0.9) || turn == MOST - 1;
        if (turn)
          set_lane(contraction, k, turn == 1 ? rate : larger(rate, known_rate));
        else if (near && known_rate < 1.0)
          set_lane(contraction, k, smaller(OLDER * known_rate, 1.0));
        if (near || far) set_lane(open, k, 0.0);
        if (turn >= SLOW) set_lane(steep, k, 1.0);
        if (far && !near)
          set_lane(refused, k, std::isfinite(m) ? this->REFUSED : m - m), set_lane(steep, k, 1.0);
      }
      before = moved;
    }
    place(gh);
    return worst(not_refused(refused)) > 0.0;
  }
};

extern template class Implicit<double>;
extern template class Implicit<Pack<4>>;

}  // namespace flexura
