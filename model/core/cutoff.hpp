// From which frequency on modes are damped: those that the tolerance does not ask for.
//
// The share of a mode is the largest tip deflection, or change of the tips' place, that it has in the answer to the loads, over the
// largest static tip deflection under them. Loads: each drive's largest force, what is out of balance at the start (gravity, a
// bent link), and the amplitude w^-1 eta' of a struck one. Modes are damped from the first on after which the sum of shares is below
// rtol / 4. Harmonic forces must be far below the cutoff: it is at least MARGIN times their frequency.
//
// Measured on 12 undamped robots at rtol 1e-2 to 1e-4 this left errors below 6 rtol, at a fifth of the passes where torques jump.
#pragma once
#include <algorithm>

#include "acting.hpp"
#include "modes.hpp"

namespace flexura {

constexpr double SHARE_OF_RTOL = 0.25, MARGIN = 5.0;

// The largest |y| and |y''| on a signal from t on, and its highest frequency. (A last segment without end: its first second.)
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

// Shares (n) of one robot's modes: w2 (n); loads: forces on the modes, (loads, n); struck: eta' (n); seen: what a unit of a mode changes
// of each output, (n, outputs), of which the first `deflections` are tip deflections. False: nothing bends.
inline bool shares(int n, const double *w2, const std::vector<std::vector<double>> &loads, const double *struck,
                   const std::vector<std::vector<double>> &seen, int deflections, double *share) {
  double largest = 0.0;
  for (int k = 0; k < n; ++k) share[k] = 0.0;
  auto with = [&](auto amplitude) {
    const int outputs = static_cast<int>(seen[0].size());
    std::vector<double> sum(seen[0].size(), 0.0);
    for (int k = 0; k < n; ++k) {
      if (!(w2[k] > 0.0)) continue;
      double most = 0.0;
      for (int o = 0; o < outputs; ++o) {
        const double x = amplitude(k) * seen[k][o];
        sum[o] += x, most = larger(most, abs(x));
      }
      share[k] += most;
    }
    for (int o = 0; o < deflections; ++o) largest = larger(largest, abs(sum[o]));
  };
  for (const auto &load : loads) with([&](int k) { return load[k] / w2[k]; });
  double moving = 0.0;
  for (int k = 0; k < n; ++k) moving = larger(moving, w2[k] > 0.0 ? abs(struck[k]) : 0.0);
  if (moving > 0.0) with([&](int k) { return struck[k] / root(w2[k]); });
  if (!(largest > 0.0)) return false;
  for (int k = 0; k < n; ++k) share[k] /= largest;
  return true;
}

// The frequency [rad/s] above which modes (ascending) may be damped; infinity: none.
inline double cutoff_of(int n, const double *w2, const double *share, double rtol, double harmonic) {
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

}  // namespace flexura
