// The method "exponential" of the time loop: Adams steps in the robot's modes
// (predictor_corrector.hpp), which are taken again as it moves (modal_basis.hpp), with fast modes
// damped that the tolerance does not ask for (numerical_damping.hpp).
//
// A step costs one pass. It begins anew, with one value and a short step, where what acts may jump;
// at a tick of a sampled controller it goes on with the past, shifted by the jump, for one pass.
#pragma once
#include "integration/exponential/energy_integrals.hpp"
#include "integration/exponential/matrices_by_passes.hpp"
#include "integration/exponential/numerical_damping.hpp"
#include "integration/method.hpp"

namespace flexura {

template <class Real>
class Exponential : public Method<Real> {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  static constexpr double GROWTH = 1.25,  // the least that a step may grow by: each new length
                                          // costs new tables
      FADING = 0.85;  // of an error from step to step: those of oscillations pass through zero
  static constexpr double SAFETY = 0.85;
  static constexpr double TIGHT = 10.0;  // the local error is kept so far below the tolerance: few
                                         // long steps add up what many short ones average out
  static constexpr double TINY = 1e-4;   // an error after which a step grows threefold, not twofold
  static constexpr double SLIDING =
      2.0;  // and further where a joint slides along a link that bends
  static constexpr double COUPLED =
      0.3;  // the error by coupled modes, over the tolerance, that is put up with at a tick
  static constexpr double KINK = 9.0;  // more error than (93) shows in the step after a tick
  static constexpr double FAST = 0.5;  // modes that turn further in a step [rad] are not resolved
  using Options = ExponentialOptions;

  Exponential(Integration<Real> &shared, double tolerance, const Options &wanted = Options())
      : Method<Real>(shared),
        c(shared),
        rtol(tolerance),
        options(wanted),
        tight(slides(shared.plant) ? SLIDING * TIGHT : TIGHT),
        n(shared.n),
        modes(n),
        matrices(n),
        steps(modes, extras_of(shared)),
        within(steps),
        accounts(steps, within, free_joints(shared)) {
    memory.lay([this](auto take) {
      for (Real **v : {&origin, &size[0], &size[1], &y, &v_, &forces}) take(*v, modes.stride + 4);
      take(state, 2 * modes.stride + 8), take(slope, 2 * modes.stride + 8);
    });
    held.reset(new bool[static_cast<std::size_t>(n)]());
    for (int i = 0; i < c.plant.joints; ++i) {
      held[c.plant.first[i]] = given_motion(c, i);
      driven = driven || (given_motion(c, i) && !c.plant.locked[i]);
    }
  }

  const char *name() const override { return "exponential"; }
  double cutoff(int k) const { return modes.cutoff[k]; }  // [rad/s]; infinity: nothing is damped
  int modes_taken(int k) const { return modes.taken[k]; }

  // At a tick to which the last step has led, the past is kept and the old values of N are shifted
  // by its jump; else a robot begins with one value.
  void begin(const Real &which, const Real &t) override {
    const Real *q = c.z.data(), *v = q + n;
    for (int k = 0; k < LANES; ++k) {
      if (lane(which, k) < 0.5) continue;
      goes_on[k] = c.acts.acting(k).sampler != nullptr && steps.reached(k, lane(t, k));
      const bool taken = modes.has_moved(k, c.plant, q) && take_modes(k, q, v, lane(t, k));
      if (goes_on[k] && !taken && !driven) continue;
      put_origin(k, q, v);
      if (goes_on[k]) transform_history(k);
      if (taken) steps.forget_tables(k);
    }
    strain = c.plant.strain(q);
    strain_before = choose_less(Real(0.5), which, strain, strain_before);
    look_at_start(t);
    bool renewed = false;
    for (int k = 0; k < LANES; ++k) {
      if (lane(which, k) < 0.5 || !goes_on[k] || !excites_coupled_modes(k)) continue;
      take_modes(k, q, v, lane(t, k), false);
      go_over_to_modes(k, q, v);
      renewed = true;
    }
    if (renewed) look_at_start(t);
    Real weigh = 0.0;
    for (int k = 0; k < LANES; ++k) {
      if (lane(which, k) < 0.5) continue;
      ticked[k] = goes_on[k];
      if (goes_on[k])
        steps.shift_history(k, lane(t, k), 2 * n);
      else
        steps.restart(k, lane(t, k)), accounts.restart(k), since[k] = 0;
      if (!goes_on[k] || weights_changed(k)) set_lane(weigh, k, 1.0);
    }
    set_error_weights(weigh, t);
  }

  Real attempt(const Real &t, const Real &h, const Real &last) override {
    if (steps.tabulate(t, h)) within.tabulate(steps.lengths());
    steps.predict();
    place(steps.predicted[0], steps.predicted[1], state);
    end = smaller(t + h, last);
    look(end, steps.predicted[0], steps.predicted[1]);
    steps.correct();
    place(steps.corrected[0], steps.corrected[1], c.znew.data());
    c.acts.prescribe(c.znew.data(), c.znew.data() + n);
    steady = accounts.steady(), built = least(steady) < 0.5;
    if (built) build(h);
    Real uncertain[2];
    account(h, Real(1.0), true, c.znew.data(), uncertain);
    strain_after = strain;
    Real squares[2];
    for (int e = 0; e < 2; ++e) {
      Real *x = e ? v_ : y;
      for (int i = 0; i < modes.chunks; ++i)
        put(x, i,
            get(steps.corrector_weights[2 + e], i) * get(steps.pece_difference, i) *
                get(size[e], i));
      squares[e] = dot(n, x, x);
    }
    Real error = root((squares[0] + squares[1]) * (1.0 / (2 * n))) * tight;
    for (int k = 0; k < LANES; ++k)
      if (ticked[k]) set_lane(error, k, KINK * lane(error, k));
    if (!(worst(error) < 1.0)) locate_error();
    return larger(error,
                  larger(abs(uncertain[0]), abs(uncertain[1])) * c.weights.joules(c.znew.data()));
  }

  void accept(const Real &which) override {
    for (int k = 0; k < LANES; ++k)
      if (lane(which, k) > 0.5) accounts.accept(k);
    steps.accept(which, end);
    strain_before = choose_less(Real(0.5), which, strain_after, strain_before);
    Real weigh = 0.0;
    for (int k = 0; k < LANES; ++k) {
      if (lane(which, k) < 0.5) continue;
      const Real *q = c.znew.data(), *v = q + n;
      ticked[k] = false;
      if (++since[k] % 8 == 0 || steps.count[k] < ORDER || weights_changed(k))
        set_lane(weigh, k, 1.0);
      if (raise_cutoff(k)) steps.forget_tables(k);
      if (!modes.has_moved(k, c.plant, q) || !take_modes(k, q, v, lane(end, k))) continue;
      go_over_to_modes(k, q, v);
      set_lane(weigh, k, 1.0);
    }
    set_error_weights(weigh, end);
  }

  void prepare(const Real &, const Real &h, const Real &) override {
    if (!built) build(h), built = true;
  }

  void between(const Real &h, const Real &x, Real *out) override {
    within.at(h, x, y, v_);
    place(y, v_, state);
    std::copy(state, state + 2 * n, out);
    Real uncertain[2];
    if (c.balanced) account(h, x, false, out, uncertain);
  }

  double restart(int k, double wish, bool first) override {
    if (first || goes_on[k]) return wish;
    return larger(0.1 * wish, 1e-3 * wished_step[k]);
  }

  double fit(int k, double wish, double left, double) override {
    wished_step[k] = wish;
    const double parts = std::ceil(left / wish - 1e-6);  // as many equal steps, if they are few
    double h = parts > 5.0 ? wish : left / parts;
    if (abs(h - steps.length(k)) < 1e-9 * h) h = steps.length(k);
    return parts <= 1.0 ? left : h;
  }

  double next(int k, double h, double error, double, bool accepted) override {
    const int order = steps.count[k] + 1;
    auto factor = [order](double e) {
      return SAFETY * flexura::power(larger(e, 1e-30), -1.0 / order);
    };
    if (!accepted) return error < 1e300 ? h * smaller(larger(0.25, factor(error)), 0.9) : 0.1 * h;
    const bool starts = steps.count[k] < ORDER;
    lately[k] = starts ? error : larger(error, FADING * lately[k]);
    double most = 1.0;  // with a larger error a step does not grow
    for (int i = 0; i < order; ++i) most *= SAFETY / GROWTH;
    if (!(starts || steps.equal_steps[k] >= 2) || lately[k] > most) return wished_step[k];
    const double wish =
        smaller(factor(lately[k]) * h, (lately[k] < TINY ? 3.0 : 2.0) * wished_step[k]);
    if (!(wish > GROWTH * wished_step[k])) return wished_step[k];
    lately[k] = 0.0;
    return wish;
  }

 protected:
  double power() const override { return ORDER + 1.0; }

 private:
  Integration<Real> &c;
  const double rtol;
  const Options options;
  const double tight;  // TIGHT, or more
  const int n;
  ModalBasis<Real> modes;
  Matrices matrices;  // where modes were looked at last
  ExponentialAdams<Real> steps;
  DenseOutput<Real> within;
  EnergyIntegrals<Real> accounts;
  Block<Real> memory;
  Real *origin, *size[2], *y, *v_, *forces, *state,
      *slope;                    // y = origin + sum eta phi; error weights of the modes; scratch
  std::unique_ptr<bool[]> held;  // (n) rows of joints whose motion is given
  Real end = 0.0;                // of the step being tried
  Real steady = 0.0;             // robots whose last attempt has accounts without integrals
  bool built = false;            // is the motion within the last attempt described?
  Real strain = 0.0, strain_before = 0.0, strain_after = 0.0;  // twice the strain energy
  double wished_step[LANES] = {}, lately[LANES] = {};          // lately: the largest error, fading
  double weighed[2][LANES] = {};  // what the error weights of the modes were taken from
  long since[LANES] = {};         // steps since the start or a break
  bool ticked[LANES] = {};        // is the next step the first one after a tick?
  bool goes_on[LANES] = {};       // has the robot kept its past at the last break?
  bool driven = false;            // has any joint a motion that is given?

  // Behind N, a row of the history keeps the accounts' numbers, then a, y and v, and the power lost
  // but to the joints' viscous friction.
  static int extras_of(const Integration<Real> &c) {
    int count = 0;
    for (int i = 0; i < c.plant.joints; ++i) count += !given_motion(c, i);
    if (c.acts.has_loads()) count += c.n - c.plant.joints;
    return EnergyIntegrals<Real>::extras(count) + 3 * c.n + 1;
  }
  static std::vector<typename EnergyIntegrals<Real>::Joint> free_joints(
      const Integration<Real> &c) {
    std::vector<typename EnergyIntegrals<Real>::Joint> out;
    for (int i = 0; i < c.plant.joints; ++i) {
      if (given_motion(c, i)) continue;
      typename EnergyIntegrals<Real>::Joint j{c.plant.first[i], 0.0, 0.0, c.plant.viscous[i]};
      for (int k = 0; k < LANES; ++k) {
        const JointDrive &d = c.acts.acting(k).joints[i];
        if (d.follows()) set_lane(j.kp, k, d.kp), set_lane(j.kd, k, d.kd);
      }
      out.push_back(j);
    }
    if (!c.acts.has_loads()) return out;
    std::vector<bool> elastic(std::size_t(c.n), true);
    for (int i = 0; i < c.plant.joints; ++i) elastic[std::size_t(c.plant.first[i])] = false;
    for (int e = 0; e < c.n; ++e)  // whose forces of loads work too
      if (elastic[std::size_t(e)]) out.push_back({e, 0.0, 0.0, 0.0});
    return out;
  }
  static bool slides(const Plant<Real> &plant) {
    return std::any_of(plant.travel.begin(), plant.travel.end(),
                       [](const Real &most) { return worst(most) > 0.0; });
  }
  const Real *kept(int row) const { return steps.extra(row) + steps.extras - 3 * n - 1; }

  // q, v of a state of the modes, into z (room for 2 n + 4).
  void place(const Real *e, const Real *ed, Real *z) const {
    std::copy(origin, origin + n, z);
    add_rows(n, modes.chunks, e, modes.phi, modes.stride,
             z);  // (what stands behind the n-th number gains nothing)
    std::fill(z + n, z + n + modes.stride, Real(0.0));
    add_rows(n, modes.chunks, ed, modes.phi, modes.stride, z + n);
  }

  // The equations at `state`, of which e, ed are the modes' part, into the new row of the history.
  void look(const Real &t, const Real *e, const Real *ed) {
    c.slope(t, state, slope);
    const int row = steps.new_row();
    const Real *q = state, *v = state + n;
    steps.force(slope + n, e, ed, steps.N[row]);
    Real given = 0.0;
    int free = 0;
    for (int i = 0; i < c.plant.joints; ++i) {
      const int e_ = c.plant.first[i];
      const Real force = c.acts.drive(i, q, v) + c.acts.on_unknown(e_);
      if (!held[e_])
        forces[free++] = force;
      else if (!c.plant.locked[i])
        given += force * v[e_];
    }
    for (; free < int(accounts.free_joints().size()); ++free)
      forces[free] = c.acts.on_unknown(accounts.free_joints()[std::size_t(free)].row);
    Real *keep = steps.extra(row) + steps.extras - 3 * n - 1;
    keep[3 * n] = accounts.record(steps.extra(row), forces, q, v, ed, slope[2 * n + LOSS], given);
    std::copy(slope + n, slope + 2 * n, keep);
    std::copy(state, state + 2 * n, keep + n);
  }

  // (97): true if robot k has come to turn so fast that fewer modes may be damped.
  bool raise_cutoff(int k) {
    const auto &most = c.weights.sizes();
    const double least = TURNING * lane((most.speed + most.deflecting) / c.plant.reach, k);
    if (options.cutoff > 0.0 || !(least > modes.cutoff[k])) return false;
    modes.cutoff[k] = 1.5 * least;
    modes.damp(k, options.zeta);
    return true;
  }

  void look_at_start(const Real &t) {
    std::copy(c.z.begin(), c.z.begin() + 2 * n, state);
    look(t, steps.eta, steps.etad);
  }

  // (94): does what has jumped at a tick make modes swing that the steps do not resolve, and that
  // the others are coupled to? Their part of the jump of N swings too; at the ticks alone it looks
  // constant, and no estimate from the values there sees the error.
  bool excites_coupled_modes(int k) const {
    const int now = steps.new_row(), before = steps.newest();
    const double h = steps.length(k);  // (negative after modes were taken: nothing is unresolved)
    double sum = 0.0;
    bool unresolved = false;
    for (int mode = 0; mode < n; ++mode) {
      double coupled = lane(steps.N[now][mode], k) - lane(steps.N[before][mode], k);
      for (std::size_t j = 0; j < accounts.free_joints().size(); ++j)
        coupled -= lane(modes.phi[mode * modes.stride + accounts.free_joints()[j].row], k) *
                   (lane(steps.extra(now)[j], k) - lane(steps.extra(before)[j], k));
      const double w = root(lane(modes.w2[mode], k)), lasts = w * h > 1.0 ? 1.0 / w : h,
                   rate = lasts * coupled, place = lasts * rate;
      unresolved = unresolved || w * h > FAST;
      for (const double error : {lane(size[0][mode], k) * place, lane(size[1][mode], k) * rate})
        sum += error * error;
    }
    return unresolved && tight * root(sum / (2 * n)) > COUPLED;
  }

  void build(const Real &h) { within.build(h), accounts.prepare(h); }

  // Sums of `which` robots that are work alone, and of the others. A work that is not finite is an
  // error.
  using Sums = typename EnergyIntegrals<Real>::Sums;
  static Sums choose(const Real &which, const Real &work, const Sums &others) {
    auto take = [&](Real alone, Real other) { return choose_less(Real(0.5), which, alone, other); };
    return {take(work, others.work), take(0.0, others.loss), take(0.0, others.numerical),
            take(0.0 * work, others.work_error), take(0.0, others.loss_error)};
  }

  // The accounts of the state at the fraction x of the step, q its place.
  void account(const Real &h, const Real &x, bool whole, Real *z, Real *uncertain) {
    Sums sums{0.0, 0.0, 0.0, 0.0, 0.0};
    if (least(steady) < 0.5) sums = accounts.over(h, x, whole, c.z.data(), z);
    if (worst(steady) > 0.5) sums = choose(steady, accounts.steady_work(c.z.data(), z), sums);
    const Real *before = c.z.data() + 2 * n;
    Real *now = z + 2 * n;
    strain = c.plant.strain(z);
    now[WORK] = before[WORK] + sums.work, now[LOSS] = before[LOSS] + sums.loss;
    now[NUMERICAL] = before[NUMERICAL] + sums.numerical;
    now[STRAIN] = before[STRAIN] + (strain - strain_before);
    uncertain[0] = sums.work_error, uncertain[1] = sums.loss_error;
  }

  // The error of the last attempt by unknowns, to say where it was worst.
  void locate_error() {
    for (int e = 0; e < 2; ++e) {
      Real *out = e ? v_ : y;
      for (int i = 0; i < modes.chunks; ++i)
        put(state, i, get(steps.corrector_weights[2 + e], i) * get(steps.pece_difference, i));
      std::fill(out, out + modes.stride, Real(0.0));
      add_rows(n, modes.chunks, state, modes.phi, modes.stride, out);
      std::copy(out, out + n, c.error.begin() + e * n);
    }
  }

  // Has what robot k is asked for grown by a tenth?
  bool weights_changed(int k) const {
    for (int e = 0; e < 2; ++e)
      if (lane(c.weights.weight[e * n], k) < 0.9 * weighed[e][k]) return true;
    return false;
  }

  // (93): error weights of the modes of robots `which` at the times t, from those of its unknowns.
  // An error of a rate moves the tips until the end of the run, or for a part of a period.
  void set_error_weights(const Real &which, const Real &t) {
    if (worst(which) < 0.5) return;
    const Real *w = c.weights.weight.data();
    for (int k = 0; k < LANES; ++k)
      for (int e = 0; e < 2 && lane(which, k) > 0.5; ++e) weighed[e][k] = lane(w[e * n], k);
    const Real left = c.end - t;
    for (int mode = 0; mode < n; ++mode) {
      const Real *phi = modes.phi + mode * modes.stride;
      Real sum[2];
      for (int e = 0; e < 2; ++e) {
        for (int i = 0; i < n; ++i) y[i] = phi[i] * w[e * n + i];
        sum[e] = root(dot(n, y, y));
      }
      const Real rate = root(modes.w2[mode]), turned = rate * left,
                 lasting = left / larger(turned, Real(1.0));
      take(which, sum, &size[0][mode], 1);
      sum[1] = larger(sum[1], lasting * sum[0]), take(which, sum + 1, &size[1][mode], 1);
    }
  }

  // Robot k's state becomes the origin.
  void put_origin(int k, const Real *q, const Real *v) {
    for (int i = 0; i < n; ++i) set_lane(origin[i], k, lane(q[i], k));
    for (int mode = 0; mode < n; ++mode) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i)
        sum += lane(v[i], k) * lane(modes.rows[i * modes.stride + mode], k);
      set_lane(steps.eta[mode], k, 0.0), set_lane(steps.etad[mode], k, sum);
    }
  }

  // Robot k goes on from its state with the modes that were just taken there.
  void go_over_to_modes(int k, const Real *q, const Real *v) {
    put_origin(k, q, v);
    transform_history(k);
    steps.forget_tables(k);
  }

  // Robot k's last values of N, and of what it loses besides, in its new modes.
  void transform_history(int k) {
    for (int age = 0; age < steps.count[k]; ++age) {
      const int row = steps.row(age);
      const Real *a = kept(row), *q = a + n, *v = q + n;
      double rest = lane(a[3 * n], k);
      for (int mode = 0; mode < n; ++mode) {
        double e = 0.0, ed = 0.0, force = 0.0;
        for (int i = 0; i < n; ++i) {
          const double x = lane(modes.rows[i * modes.stride + mode], k);
          e += lane(q[i] - origin[i], k) * x, ed += lane(v[i], k) * x, force += lane(a[i], k) * x;
        }
        set_lane(steps.N[row][mode], k,
                 force + lane(modes.w2[mode], k) * e + lane(modes.own[mode], k) * ed);
        rest -= lane(modes.material[mode], k) * ed * ed;
      }
      set_lane(accounts.rest_of(steps.extra(row)), k, rest);
    }
  }

  // Takes robot k's modes at q, or only if they are poor there; true if so. The cutoff is found at
  // the start.
  bool take_modes(int k, const Real *q, const Real *v, double t, bool if_poor = true) {
    Matrices &m = matrices;
    if (!c.plant.matrices(k, q, m.M.data(), m.K.data(), m.D.data()))
      matrices_by_passes(c.plant, k, q, m), c.passes += n + 1;
    for (int i = 0; i < c.plant.joints; ++i) {
      const JointDrive &d = c.acts.acting(k).joints[i];
      const int e = c.plant.first[i];
      if (held[e]) continue;
      m.joint_damping[e] = lane(c.plant.viscous[i], k) + (d.follows() ? d.kd : 0.0);
      m.joint_stiffness[e] = d.follows() ? d.kp : 0.0;
    }
    const bool first = modes.taken[k] == 0;
    if (!modes.take(k, m, q, held.get(), wished_step[k] > 0.0 ? 1.0 / wished_step[k] : 1.0,
                    options.zeta, if_poor))
      return false;
    if (first && options.damping) {
      modes.cutoff[k] = options.cutoff > 0.0
                            ? options.cutoff
                            : find_cutoff(c, modes, held.get(), rtol, k, m, q, v, t);
      modes.damp(k, options.zeta);
    }
    accounts.take_rows();
    return true;
  }
};

extern template class Exponential<double>;
extern template class Exponential<Pack<4>>;

}  // namespace flexura
