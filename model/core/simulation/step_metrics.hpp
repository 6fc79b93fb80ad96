// Figures of a controlled motion (80), each with one definition, from samples t (T) of a joint's
// position q with its reference r, and of the last flexible link's tip deflection w. Of a joint,
// with r its reference before any filter, D = r(end) - q(0), y = (q - q(0)) / D:
//
//   rise        time from y = 10 % to y = 90 %, both crossed for the first time [s]
//   settling    time after which |y - 1| stays within 2 % [s]
//   overshoot   largest y - 1, not below 0 [1]
//   error       |y - 1|, its mean over the last tenth of the time [1]
//   itae        int t |r - q| dt / |D| [s^2]
//   effort      int (u / limit)^2 dt / T, u the output of the law as given; 0 where it has no limit
//   [1]
//
// and of the strip, b being the instant at which the slowest joint has settled, at the latest a
// fifth of the time before the end:
//
//   peak        largest |w - w(0)| [m]
//   residual    half of w's range from b on [m]
//   vibration   int t |w - w(end)| dt [m s^2], w(end) the mean over the last tenth: what bends the
//   link for good doesn't count rms         sqrt(int (w - w(end))^2 dt / T) [m]
//
// What never happens is not a number: the rise of a joint that doesn't arrive, settling of one that
// doesn't settle.
#pragma once

namespace flexura {

enum JointFigure { RISE, SETTLING, OVERSHOOT, ERROR, ITAE, EFFORT, JOINT_FIGURES };
enum StripFigure { PEAK, RESIDUAL, VIBRATION, RMS, STRIP_FIGURES };

struct Samples {
  const double *t;
  int count;
};

// A joint's figures but the effort, into out (JOINT_FIGURES).
void joint_metrics(const Samples &at, const double *r, const double *q, double *out);

// The strip's figures into out (STRIP_FIGURES); `settled` [s], the slowest joint's, may be no
// number.
void strip_metrics(const Samples &at, const double *w, double settled, double *out);

// Adds the samples from `begin` to before `end` to a joint's overshoot and ITAE so far, which only
// grow. r is known to its end.
void joint_so_far(const Samples &at, const double *r, const double *q, int begin, int end,
                  double *out);

// What the vibration comes to at least, whatever w(end) will be, from the first `seen` samples:
//
//   int t |w - w(end)| dt >= min_c g(c),   g(c) = int_0^now t |w - c| dt.
//
// g is convex: the tangents on both sides of its least value meet below it. They are drawn nearer
// until the bound is above `enough` or g, and with it every bound, is not.
double vibration_lower_bound(const Samples &at, const double *w, int seen, double enough);

}  // namespace flexura
