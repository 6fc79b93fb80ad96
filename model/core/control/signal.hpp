// Functions of time (60) with two derivatives: forces to apply, motions to follow.
//
// A signal is a list of segments, ascending in t0; on each, with s = t - t0,
//
//     y(s) = c0 + c1 s + ... + c5 s^5 + A sin(w s + phi).                            (60)
//
// It jumps or kinks only where a segment begins. Before the first segment it keeps its first value.
#pragma once
#include <vector>

#include "numbers/scalars.hpp"

namespace flexura {

// One row of ten numbers; an array of shape (k, 10) is k of these.
struct Segment {
  double t0, c[6], A, w, phi;
};
static_assert(sizeof(Segment) == 10 * sizeof(double), "rows of ten numbers");

using Signal = std::vector<Segment>;

struct Motion {
  double y, yd, ydd;
};

// A segment (60) at time t, whether it holds there or not.
inline Motion evaluate(const Segment &g, double t) {
  const double s = t - g.t0, *c = g.c;
  Motion m;
  m.y = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
  m.yd = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * (5.0 * c[5]))));
  m.ydd = 2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * (20.0 * c[5])));
  if (g.A != 0.0) {
    double sine, cosine;
    sincos(g.w * s + g.phi, sine, cosine);
    m.y += g.A * sine, m.yd += g.A * g.w * cosine, m.ydd -= g.A * g.w * g.w * sine;
  }
  return m;
}

// A signal at time t; 0 where it has no segments.
inline Motion evaluate(const Signal &signal, double t) {
  if (signal.empty()) return {0.0, 0.0, 0.0};
  std::size_t low = 0, high = signal.size();  // the last segment that starts at or before t
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (signal[middle].t0 <= t ? low : high) = middle;
  }
  const Segment &g = signal[low];
  if (t < g.t0) return {evaluate(g, g.t0).y, 0.0, 0.0};
  return evaluate(g, t);
}

}  // namespace flexura
