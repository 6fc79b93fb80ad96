// What a run asks of a robot's modes at its start: the loads on them, and what they change of the outputs; from these, the cutoff.
#pragma once
#include "cutoff.hpp"
#include "method.hpp"

namespace flexura {

template <class Real> inline bool given_motion(const Course<Real> &c, int joint) {
  const JointDrive &d = c.acts.acting(0).joints[joint];
  return c.plant.locked[joint] || (d.prescribed && d.follows());
}

// The tip deflections (joints) and the last tip's place that a unit of each mode of robot k changes at q, by differences; (n, joints + 2).
// Empty: the plant does not say.
template <class Real>
std::vector<std::vector<double>> outputs_of_modes(Course<Real> &c, const Modes<Real> &modes, int k, const Real *q) {
  const int n = c.n, outputs = c.plant.joints + 2;
  const std::size_t room = static_cast<std::size_t>(outputs);
  std::vector<std::vector<double>> seen(static_cast<std::size_t>(n), std::vector<double>(room, 0.0));
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

// Forces on the modes of robot k (loads, n): of each joint's drive at its largest (or of what its prescribed motion shakes), and what is out
// of balance at q. `harmonic`: the highest frequency in a signal [rad/s]; m: its matrices; held (n): rows of given motions.
template <class Real>
std::vector<std::vector<double>> loads_on_modes(Course<Real> &c, const Modes<Real> &modes, const bool *held, int k, const Matrices &m,
                                                const Real *q, double t, double &harmonic) {
  const int n = c.n, joints = c.plant.joints;
  const std::size_t size = static_cast<std::size_t>(n), count = static_cast<std::size_t>(joints);
  const Acting &acting = c.acts.acting(k);
  std::vector<std::vector<double>> loads;
  for (int i = 0; i < joints; ++i) {
    const JointDrive &d = acting.joints[i];
    const int e = c.plant.first[i];
    const Extremes force = extremes(d.force, t, 0.0), motion = extremes(d.motion, t, lane(q[e], k));
    harmonic = larger(harmonic, larger(force.frequency, motion.frequency));
    double most = force.value + d.kp * motion.value;
    if (acting.function || acting.sampler) most = larger(most, 1.0);  // not known: any will do, shares being relative
    std::vector<double> load(size, 0.0);
    for (int mode = 0; mode < n; ++mode) {
      const Real *phi = modes.phi + mode * modes.stride;
      if (!held[e]) load[mode] = most * lane(phi[e], k);
      else if (d.prescribed)
        for (int j = 0; j < n; ++j) load[mode] += held[j] ? 0.0 : lane(phi[j], k) * m.M[j * n + e] * motion.acceleration;
    }
    loads.push_back(load);
  }
  std::vector<Real> zero(size, Real(0.0)), rest(size), none(count, Real(0.0)), reaction(count);
  std::vector<char> fixed(count, 0);
  for (int i = 0; i < joints; ++i) fixed[i] = given_motion(c, i);
  const Pass<Real> pass{q, zero.data(), q, zero.data(), Real(0.0), Real(0.0), zero.data(), none.data(), none.data(), fixed.data(), none.data()};
  c.plant.accelerate(pass, rest.data(), reaction.data());
  ++c.passes;
  loads.emplace_back(size, 0.0);
  for (int mode = 0; mode < n; ++mode)
    for (int i = 0; i < n; ++i) loads.back()[mode] += lane(modes.rows[i * modes.stride + mode] * rest[i], k);
  return loads;
}

// The cutoff of robot k that starts at (q, v) at time t [rad/s]; infinity: no mode may be damped.
template <class Real>
double find_cutoff(Course<Real> &c, const Modes<Real> &modes, const bool *held, double rtol, int k, const Matrices &m, const Real *q,
                   const Real *v, double t) {
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
  if (!shares(n, w2.data(), loads, struck.data(), seen, c.plant.joints, share.data())) return none;
  return cutoff_of(n, w2.data(), share.data(), rtol, harmonic);
}

}  // namespace flexura
