#include "simulation/step_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexura {
namespace {

constexpr double LOW = 0.1, HIGH = 0.9, BAND = 0.02;
constexpr double NEVER = std::numeric_limits<double>::quiet_NaN(),
                 INFINITE = std::numeric_limits<double>::infinity();

// t |r - q| of sample k, t from the start.
double weighed_error(const Samples &at, const double *r, const double *q, int k) {
  return (at.t[k] - at.t[0]) * std::fabs(r[k] - q[k]);
}

// Is sample k in the last tenth of the time?
bool late(const Samples &at, int k) {
  return at.t[k] >= at.t[at.count - 1] - 0.1 * (at.t[at.count - 1] - at.t[0]);
}

// Of sample k of `count` in int t f(t) dt by the trapezoidal rule.
double weight(const double *t, int k, int count) {
  const double dt = (k > 0 ? t[k] - t[k - 1] : 0.0) + (k + 1 < count ? t[k + 1] - t[k] : 0.0);
  return 0.5 * (t[k] - t[0]) * dt;
}

}  // namespace

void joint_metrics(const Samples &at, const double *r, const double *q, double *out) {
  const double *t = at.t, way = r[at.count - 1] - q[0];
  double low = NEVER, high = NEVER, settled = 0.0, most = 0.0, itae = 0.0, error = 0.0;
  int last = 0;
  for (int k = 0; k < at.count; ++k) {
    const double y = (q[k] - q[0]) / way;
    most = std::max(most, y - 1.0);
    if (late(at, k)) error += std::fabs(y - 1.0), ++last;
    if (k == 0) continue;
    const double before = (q[k - 1] - q[0]) / way, dt = t[k] - t[k - 1];
    if (std::isnan(low) && y >= LOW) low = t[k] - dt * (y - LOW) / (y - before);
    if (std::isnan(high) && y >= HIGH) high = t[k] - dt * (y - HIGH) / (y - before);
    const double off = std::fabs(y - 1.0), was = std::fabs(before - 1.0);
    if (off > BAND)
      settled = NEVER;
    else if (was > BAND)
      settled = t[k] - t[0] - dt * (BAND - off) / (was - off);
    itae += 0.5 * dt * (weighed_error(at, r, q, k - 1) + weighed_error(at, r, q, k));
  }
  out[RISE] = high - low, out[SETTLING] = settled, out[OVERSHOOT] = most, out[ERROR] = error / last,
  out[ITAE] = itae / std::fabs(way);
}

void strip_metrics(const Samples &at, const double *w, double settled, double *out) {
  const double *t = at.t, end = t[at.count - 1] - t[0];
  double rest = 0.0;
  int last = 0;
  for (int k = 0; k < at.count; ++k)
    if (late(at, k)) rest += w[k], ++last;
  rest /= last;
  const double begin = std::isnan(settled) || settled > 0.8 * end ? 0.8 * end : settled;
  double peak = 0.0, least = INFINITE, most = -INFINITE, vibration = 0.0, square = 0.0;
  for (int k = 0; k < at.count; ++k) {
    peak = std::max(peak, std::fabs(w[k] - w[0]));
    if (t[k] - t[0] >= begin) least = std::min(least, w[k]), most = std::max(most, w[k]);
    if (k == 0) continue;
    const double dt = t[k] - t[k - 1], a = w[k - 1] - rest, b = w[k] - rest;
    vibration += 0.5 * dt * ((t[k - 1] - t[0]) * std::fabs(a) + (t[k] - t[0]) * std::fabs(b));
    square += 0.5 * dt * (a * a + b * b);
  }
  out[PEAK] = peak, out[RESIDUAL] = 0.5 * (most - least), out[VIBRATION] = vibration,
  out[RMS] = std::sqrt(square / end);
}

void joint_so_far(const Samples &at, const double *r, const double *q, int begin, int end,
                  double *out) {
  const double *t = at.t, way = r[at.count - 1] - q[0];
  for (int k = begin; k < end; ++k) {
    out[OVERSHOOT] = std::max(out[OVERSHOOT], (q[k] - q[0]) / way - 1.0);
    if (k > 0)
      out[ITAE] += 0.5 * (t[k] - t[k - 1]) *
                   (weighed_error(at, r, q, k - 1) + weighed_error(at, r, q, k)) / std::fabs(way);
  }
}

double vibration_lower_bound(const Samples &at, const double *w, int seen, double enough) {
  double sum = 0.0, moment = 0.0, low = INFINITE, high = -INFINITE;
  for (int k = 0; k < seen; ++k) {
    const double own = weight(at.t, k, seen);
    sum += own, moment += own * w[k];
    low = std::min(low, w[k]), high = std::max(high, w[k]);
  }
  if (!(high > low) || sum == 0.0) return 0.0;
  double a = low, ga = moment - sum * low, sa = -sum, b = high, gb = sum * high - moment, sb = sum;
  double floor = 0.0;
  const double blur = 1e-9 * sum * (high - low);  // far more than the rounding of these sums
  for (int turn = 0; turn < 12; ++turn) {
    const double c = (gb - ga + sa * a - sb * b) / (sa - sb);
    floor = ga + sa * (c - a) - blur;
    double g = 0.0, slope = 0.0;
    for (int k = 0; k < seen; ++k) {
      const double own = weight(at.t, k, seen), off = w[k] - c;
      g += own * std::fabs(off);
      slope -= off > 0.0 ? own : -own;
    }
    if (floor > enough || g <= enough || g - floor < 1e-3 * g) break;
    if (slope < 0.0)
      a = c, ga = g, sa = slope;
    else
      b = c, gb = g, sb = slope;
  }
  return std::max(floor, 0.0);
}

}  // namespace flexura
