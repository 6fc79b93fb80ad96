// Numerical damping (95): the cutoff frequency above which modes are damped, those that the
// tolerance does not ask for (96), (97).
//
// The share of a mode is the largest tip deflection, or change of the tips' place, that it has in
// the answer to the loads, over the largest tip deflection that they reach in the run: the static
// one, or less where the run ends before a mode has answered. Loads: each drive's
// largest force, what is out of balance at the start (gravity, a bent link), and the amplitude w^-1
// eta' of a struck one. A force of unknown size, a controller's, is seen beside its own largest
// deflection; where it follows its joint, the joint's place is an output, too. Modes are damped
// from the first on after which the sum of shares is below rtol / 4. Harmonic forces must be far
// below the cutoff: it is at least MARGIN times their frequency. So must the robot's own rates:
// where it turns fast, N changes with the modes as much as their stiffness does, and the damping
// would feed them. The cutoff is at least TURNING times the speed of the tips over the robot's
// length.
//
// Measured on 12 undamped robots at rtol 1e-2 to 1e-4 this left errors below 6 rtol, at a fifth of
// the passes where torques jump.
#pragma once
#include <algorithm>

#include "control/inputs.hpp"
#include "integration/exponential/modal_basis.hpp"
#include "integration/method.hpp"

namespace flexura {

constexpr double SHARE_OF_RTOL = 0.25, MARGIN = 5.0, TURNING = 20.0;

// The largest |y| and |y''| on a signal from t on, and its highest frequency. (A last segment
// without end: its first second.)
struct Extremes {
  double value = 0.0, acceleration = 0.0, frequency = 0.0;
};
inline Extremes extremes(const Signal &signal, double t, double about) {
  Extremes out;
  for (std::size_t k = 0; k < signal.size(); ++k) {
    const bool last = k + 1 == signal.size();
    if (!last && signal[k + 1].t0 <= t) continue;
    Segment g = signal[k];
    const double from = larger(g.t0, t), to = last ? from + 1.0 : signal[k + 1].t0, A = abs(g.A);
    g.A = 0.0;
    for (int i = 0; i <= 8; ++i) {
      const Motion m = evaluate(g, from + (to - from) * i / 8.0);
      out.value = larger(out.value, abs(m.y - about) + A);
      out.acceleration = larger(out.acceleration, abs(m.ydd) + A * g.w * g.w);
    }
    if (A > 0.0) out.frequency = larger(out.frequency, abs(g.w));
  }
  return out;
}

// A force on each mode (n); `sized`: whether its size is known, or only its direction.
struct ModalLoad {
  std::vector<double> force;
  bool sized = true;
};

// Shares (96) (n) of one robot's modes: w2 (n); struck: eta' (n); seen: what a unit of a mode
// changes of each output, (n, outputs), of which the first `deflections` are tip deflections; left:
// of the run [s]. Loads of known size are seen beside the largest deflection of them all, one of
// unknown size beside its own. False: nothing bends.
inline bool shares(int n, const double *w2, const std::vector<ModalLoad> &loads,
                   const double *struck, const std::vector<std::vector<double>> &seen,
                   int deflections, double left, double *share) {
  const std::size_t size = static_cast<std::size_t>(n);
  std::vector<double> known(size, 0.0);
  double largest = 0.0;
  bool bends = false;
  for (int k = 0; k < n; ++k) share[k] = 0.0;
  // reached(k): what a mode reaches of its amplitude until the run's end.
  auto with = [&](auto amplitude, auto reached, bool sized) {
    std::vector<double> sum(seen[0].size(), 0.0), own(size, 0.0);
    for (int k = 0; k < n; ++k)
      for (std::size_t o = 0; w2[k] > 0.0 && o < sum.size(); ++o) {
        const double x = amplitude(k) * seen[k][o];
        sum[o] += smaller(1.0, reached(k)) * x, own[k] = larger(own[k], abs(x));
      }
    double most = 0.0;
    for (int o = 0; o < deflections; ++o) most = larger(most, abs(sum[o]));
    bends = bends || most > 0.0;
    if (sized) largest = larger(largest, most);
    for (int k = 0; k < n; ++k)
      if (sized)
        known[k] += own[k];
      else if (most > 0.0)
        share[k] += own[k] / most;
  };
  for (const ModalLoad &load : loads)
    with([&](int k) { return load.force[k] / w2[k]; },
         [&](int k) { return 0.5 * w2[k] * left * left; }, load.sized);
  double moving = 0.0;
  for (int k = 0; k < n; ++k) moving = larger(moving, w2[k] > 0.0 ? abs(struck[k]) : 0.0);
  if (moving > 0.0)
    with([&](int k) { return struck[k] / root(w2[k]); }, [&](int k) { return root(w2[k]) * left; },
         true);
  for (int k = 0; largest > 0.0 && k < n; ++k) share[k] += known[k] / largest;
  return bends;
}

// The frequency [rad/s] (97) above which modes (ascending) may be damped; infinity: none.
inline double cutoff_of(int n, const double *w2, const double *share, double rtol,
                        double harmonic) {
  double tail = 0.0;
  int first = n;
  for (int k = n - 1; k >= 0; --k) {
    tail += share[k];
    if (!(w2[k] > 0.0) || tail >= SHARE_OF_RTOL * rtol) break;
    first = k;
  }
  if (first == n) return std::numeric_limits<double>::infinity();
  return larger(root(w2[first]) * (1.0 - 1e-6), MARGIN * harmonic);
}

template <class Real>
inline bool given_motion(const Integration<Real> &c, int joint) {
  const JointDrive &d = c.acts.acting(0).joints[joint];
  return c.plant.locked[joint] || (d.prescribed && d.follows());
}

// The tip deflections (joints) and the last tip's place that a unit of each mode of robot k changes
// at q, by differences; (n, joints + 2). Empty: the plant does not say.
template <class Real>
std::vector<std::vector<double>> outputs_of_modes(Integration<Real> &c,
                                                  const ModalBasis<Real> &modes, int k,
                                                  const Real *q) {
  const int n = c.n, outputs = c.plant.joints + 2;
  const std::size_t room = static_cast<std::size_t>(outputs);
  std::vector<std::vector<double>> seen(static_cast<std::size_t>(n),
                                        std::vector<double>(room, 0.0));
  std::vector<Real> place(q, q + n);
  std::vector<double> low(room), high(room);
  for (int mode = 0; mode < n; ++mode) {
    const Real *phi = modes.phi + mode * modes.stride;
    double most = 0.0;
    for (int i = 0; i < n; ++i) most = larger(most, abs(lane(phi[i] * c.plant.lever[i], k)));
    const double e = 1e-6 * lane(c.plant.reach, k) / larger(most, 1e-300);
    auto look = [&](double by, std::vector<double> &out) {
      for (int i = 0; i < n; ++i) set_lane(place[i], k, lane(q[i], k) + by * lane(phi[i], k));
      return c.plant.observe(k, place.data(), out.data());
    };
    if (!look(-e, low) || !look(e, high)) return {};
    for (int o = 0; o < outputs; ++o) seen[mode][o] = (high[o] - low[o]) / (2.0 * e);
  }
  return seen;
}

// Adds the forces on the modes of robot k of each force and moment on a link, at its largest.
template <class Real>
void add_loads_on_links(Integration<Real> &c, const ModalBasis<Real> &modes, int k, const Real *q,
                        double t, std::vector<ModalLoad> &loads, double &harmonic) {
  if (!c.acts.has_loads()) return;
  const std::size_t size = std::size_t(c.n), count = c.acts.acting(k).loads.size();
  for (std::size_t a = 0; a < 3 * count; ++a) {
    const Extremes most = extremes(c.acts.acting(k).loads[a / 3].value[a % 3], t, 0.0);
    harmonic = larger(harmonic, most.frequency);
    if (!(most.value > 0.0)) continue;
    std::vector<Real> value(3 * count, Real(0.0)), force(size, Real(0.0));
    value[a] = Real(most.value);
    c.acts.loads_at(q, value.data(), force.data());
    loads.push_back({std::vector<double>(size, 0.0)});
    for (std::size_t mode = 0; mode < size; ++mode)
      for (std::size_t i = 0; i < size; ++i)
        loads.back().force[mode] +=
            lane(modes.phi[mode * std::size_t(modes.stride) + i] * force[i], k);
  }
}

// Forces on the modes of robot k (loads, n): of each joint's drive and load at its largest (or of
// what a prescribed motion shakes), and what is out of balance at q. `harmonic`: the highest
// frequency in a signal [rad/s]; m: its matrices; held (n): rows of given motions.
template <class Real>
std::vector<ModalLoad> loads_on_modes(Integration<Real> &c, const ModalBasis<Real> &modes,
                                      const bool *held, int k, const Matrices &m, const Real *q,
                                      double t, double &harmonic) {
  const int n = c.n, joints = c.plant.joints;
  const std::size_t size = static_cast<std::size_t>(n), count = static_cast<std::size_t>(joints);
  const Inputs &acting = c.acts.acting(k);
  std::vector<ModalLoad> loads;
  for (int i = 0; i < joints; ++i) {
    const JointDrive &d = acting.joints[i];
    const int e = c.plant.first[i];
    const Extremes force = extremes(d.force, t, 0.0), motion = extremes(d.motion, t, lane(q[e], k));
    harmonic = larger(harmonic, larger(force.frequency, motion.frequency));
    const bool sized = !acting.function && !acting.sampler;
    const double most = sized ? force.value + d.kp * motion.value : 1.0;
    std::vector<double> load(size, 0.0);
    for (int mode = 0; mode < n; ++mode) {
      const Real *phi = modes.phi + mode * modes.stride;
      if (!held[e])
        load[mode] = most * lane(phi[e], k);
      else if (d.prescribed)
        for (int j = 0; j < n; ++j)
          load[mode] += held[j] ? 0.0 : lane(phi[j], k) * m.M[j * n + e] * motion.acceleration;
    }
    loads.push_back({load, sized || held[e]});
  }
  add_loads_on_links(c, modes, k, q, t, loads, harmonic);
  std::vector<Real> zero(size, Real(0.0)), rest(size), none(count, Real(0.0)), reaction(count);
  std::vector<char> fixed(count, 0);
  for (int i = 0; i < joints; ++i) fixed[i] = given_motion(c, i);
  const PassInputs<Real> pass{q,           zero.data(),  q,           zero.data(),
                              Real(0.0),   Real(0.0),    zero.data(), none.data(),
                              none.data(), fixed.data(), none.data()};
  c.plant.accelerate(pass, rest.data(), reaction.data());
  ++c.passes;
  loads.push_back({std::vector<double>(size, 0.0)});
  for (int mode = 0; mode < n; ++mode)
    for (int i = 0; i < n; ++i)
      loads.back().force[mode] += lane(modes.rows[i * modes.stride + mode] * rest[i], k);
  return loads;
}

// Adds each mode's share in what the force of a joint does to the joint's own place, for joints
// whose force follows it.
template <class Real>
void add_shares_of_feedback(const Integration<Real> &c, const ModalBasis<Real> &modes,
                            const bool *held, int k, std::vector<double> &share) {
  const Inputs &acting = c.acts.acting(k);
  for (int i = 0; i < c.plant.joints; ++i) {
    const JointDrive &d = acting.joints[i];
    const int e = c.plant.first[i];
    const bool fed_back = acting.function || acting.sampler || d.kp > 0.0 || d.kd > 0.0;
    if (held[e] || !fed_back) continue;
    std::vector<double> own(share.size(), 0.0);
    double total = 0.0;
    for (std::size_t mode = 0; mode < share.size(); ++mode) {
      const double at = lane(modes.phi[mode * std::size_t(modes.stride) + std::size_t(e)], k);
      const double w2 = lane(modes.w2[mode], k);
      if (w2 > 0.0) total += own[mode] = at * at / w2;
    }
    for (std::size_t mode = 0; total > 0.0 && mode < share.size(); ++mode)
      share[mode] += own[mode] / total;
  }
}

// The cutoff of robot k that starts at (q, v) at time t [rad/s]; infinity: no mode may be damped.
template <class Real>
double find_cutoff(Integration<Real> &c, const ModalBasis<Real> &modes, const bool *held,
                   double rtol, int k, const Matrices &m, const Real *q, const Real *v, double t) {
  const int n = c.n;
  const double none = std::numeric_limits<double>::infinity();
  const auto seen = outputs_of_modes(c, modes, k, q);
  if (seen.empty()) return none;
  double harmonic = 0.0;
  const auto loads = loads_on_modes(c, modes, held, k, m, q, t, harmonic);
  std::vector<double> w2(seen.size()), share(seen.size()), struck(seen.size(), 0.0);
  for (int mode = 0; mode < n; ++mode) {
    w2[mode] = lane(modes.w2[mode], k);
    for (int i = 0; i < n; ++i) struck[mode] += lane(modes.rows[i * modes.stride + mode] * v[i], k);
  }
  if (!shares(n, w2.data(), loads, struck.data(), seen, c.plant.joints, c.end - t, share.data()))
    return none;
  add_shares_of_feedback(c, modes, held, k, share);
  return cutoff_of(n, w2.data(), share.data(), rtol, harmonic);
}

}  // namespace flexura
