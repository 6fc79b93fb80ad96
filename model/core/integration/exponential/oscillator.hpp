// One damped oscillator x'' + d2 x' + w2 x = f, solved exactly over a step h (89): the free motion,
// and the response to powers of time.
//
// With g the response to an impulse (g'' + d2 g' + w2 g = 0, g(0) = 0, g'(0) = 1) and f = sum_m f_m
// (t/h)^m,
//
//     x(h)  = (g' + d2 g) x(0) + g x'(0) + sum_m A_m f_m      A_m = int_0^h g(h - t) (t/h)^m dt
//     x'(h) = -w2 g x(0)      + g' x'(0) + sum_m B_m f_m      B_m = int_0^h g'(h - t) (t/h)^m dt
//
// By parts, B_m = m A_(m-1) / h (m > 0), B_0 = g, and a_m = A_m / h^2 obeys (90)
//
//     w2 h^2 a_m + d2 h m a_(m-1) + m (m - 1) a_(m-2) = 1,     m > 1.
//
// This recurrence runs upwards where w2 h^2 is large, downwards where it is small, and where
// damping is strong it is solved as the boundary value problem that it is (Olver; an overdamped
// mode needs no pivoting).
#pragma once
#include "numbers/modal_vectors.hpp"

namespace flexura {

constexpr int POWERS = 6;  // of time: f_0 ... f_5

// g(h), g'(h) of one oscillator, however damped.
inline void impulse_response(double w2, double d2, double h, double &g, double &dg) {
  const double decay = 0.5 * d2, square = w2 - decay * decay, z = square * h * h;
  if (abs(z) < 1e-4) {  // near the critical damping, and free motion: series in z
    const double e = exp(-decay * h);
    g = e * h * (1.0 - z * (1.0 / 6) * (1.0 - z * (1.0 / 20) * (1.0 - z * (1.0 / 42))));
    dg = e * (1.0 - z * 0.5 * (1.0 - z * (1.0 / 12) * (1.0 - z * (1.0 / 30)))) - decay * g;
  } else if (square > 0.0) {
    const double omega = root(square), e = exp(-decay * h);
    double sine, cosine;
    sincos(omega * h, sine, cosine);
    g = e * sine / omega, dg = e * cosine - decay * g;
  } else {
    const double kappa = root(-square), fast = decay + kappa, slow = w2 / fast;  // rates of decay
    const double e = exp(-slow * h), f = exp(-fast * h);
    g = (e - f) / (2.0 * kappa), dg = (fast * f - slow * e) / (2.0 * kappa);
  }
}

// The same of four oscillators that all oscillate; h may differ.
inline void impulse_responses(Lanes w2, Lanes d2, Lanes h, Lanes &g, Lanes &dg) {
  const Lanes decay = 0.5 * d2, omega = root(w2 - decay * decay);
  Lanes sine, cosine;
  sincos(omega * h, sine, cosine);
  if (worst(decay) > 0.0) {
    const Lanes e = exp(-(decay * h));
    sine = e * sine, cosine = e * cosine;
  }
  g = sine / omega, dg = cosine - decay * g;
}

// Which way the recurrence runs. (Both ways agree between 9 and 36.)
enum class Run { up, near, down, bounded };
inline Run run_of(double w2, double d2, double h) {
  const double x2 = w2 * h * h, dd = d2 * h;
  if (x2 >= 9.0 && dd < 0.6 * x2) return Run::up;
  if (x2 < 1.0 && dd < 0.1) return Run::near;
  return dd < 3.0 || dd * dd < 4.2 * x2 ? Run::down : Run::bounded;
}

// (90): a_m, m < POWERS, upwards from a_0 and a_1. Number: double or Lanes.
template <class Number>
inline void moments_upwards(Number x2, Number dd, Number g_h, Number dg, Number *a) {
  const Number inverse = 1.0 / x2;
  a[0] = (1.0 - dg - dd * g_h) * inverse;  // g_h = g / h
  a[1] = (1.0 - g_h - dd * a[0]) * inverse;
  for (int m = 2; m < POWERS; ++m)
    a[m] = (1.0 - dd * double(m) * a[m - 1] - double(m * (m - 1)) * a[m - 2]) * inverse;
}

// (90) downwards from far above, where a_m is nearly 1 / m^2; what is wrong with the guess is gone
// below round-off at the end.
template <class Number>
inline void moments_downwards(Number x2, Number dd, int from, Number *a) {
  Number above = 1.0 / double(from * from), here = 1.0 / double((from - 1) * (from - 1));
  for (int m = from; m > 1; --m) {
    const Number below = (1.0 - x2 * above) * (1.0 / (m * (m - 1))) - dd * (1.0 / (m - 1)) * here;
    above = here, here = below;
    if (m - 2 < POWERS) a[m - 2] = below;
  }
}

// Strong damping: b_m = B_m / h obeys x2 b_(m+1) / (m + 1) + dd b_m + m b_(m-1) = 1 from b_0 = g /
// h to nearly 1 / (dd + m).
inline void moments_bounded(double x2, double dd, double g_h, double *a) {
  constexpr int SIZE = 36;
  double b[SIZE + 1], upper[SIZE];
  b[0] = g_h, upper[0] = 0.0;  // row by row: b_m = b[m] - upper[m] b_(m+1)
  for (int m = 1; m < SIZE; ++m) {
    const double pivot = dd - m * upper[m - 1];
    upper[m] = x2 / ((m + 1) * pivot), b[m] = (1.0 - m * b[m - 1]) / pivot;
  }
  double following = 1.0 / (dd + SIZE + x2 / (SIZE + 1));
  for (int m = SIZE - 1; m >= 0; --m) following = b[m] - upper[m] * following, b[m] = following;
  for (int m = 0; m < POWERS; ++m) a[m] = b[m + 1] / (m + 1);
}

// The free motion and the moments of one robot's modes over a step: rows of `step` (4, stride): g'
// + d2 g, g, -w2 g, g'; A, B (POWERS, stride). `lag` (s): the oscillator is driven by f + lag f'
// (see predictor_corrector.hpp); zero: by f alone.
inline void propagate(int chunks, int stride, const double *w2, const double *d2, const double *lag,
                      double h, double *step, double *A, double *B) {
  auto one = [&](int i) {
    const double x2 = w2[i] * h * h, dd = d2[i] * h;
    double g, dg, a[POWERS];
    impulse_response(w2[i], d2[i], h, g, dg);
    switch (run_of(w2[i], d2[i], h)) {
      case Run::up: moments_upwards(x2, dd, g / h, dg, a); break;
      case Run::near: moments_downwards(x2, dd, 20, a); break;
      case Run::down: moments_downwards(x2, dd, 40, a); break;
      case Run::bounded: moments_bounded(x2, dd, g / h, a); break;
    }
    step[i] = dg + d2[i] * g, step[stride + i] = g, step[2 * stride + i] = -w2[i] * g,
    step[3 * stride + i] = dg;
    for (int m = 0; m < POWERS; ++m) A[m * stride + i] = a[m];
  };
  for (int c = 0; c < chunks; ++c) {
    const Run run = run_of(w2[4 * c], d2[4 * c], h);
    bool alike = run != Run::bounded, oscillate = true;
    for (int i = 4 * c; i < 4 * c + 4; ++i) {
      const double decay = 0.5 * d2[i], z = (w2[i] - decay * decay) * h * h;
      alike = alike && run_of(w2[i], d2[i], h) == run, oscillate = oscillate && z >= 1e-4;
    }
    if (!alike || !oscillate) {
      for (int i = 4 * c; i < 4 * c + 4; ++i) one(i);
    } else {
      const Lanes w = get(w2, c), d = get(d2, c), x2 = w * h * h, dd = d * h;
      Lanes g, dg, a[POWERS];
      impulse_responses(w, d, h, g, dg);
      if (run == Run::up)
        moments_upwards(x2, dd, g / Lanes(h), dg, a);
      else
        moments_downwards(x2, dd, run == Run::near ? 20 : 40, a);
      put(step, c, dg + d * g), put(step + stride, c, g), put(step + 2 * stride, c, -(w * g)),
          put(step + 3 * stride, c, dg);
      for (int m = 0; m < POWERS; ++m) put(A + m * stride, c, a[m]);
    }
    Lanes before_A = 0.0, before_B = 0.0;
    const Lanes behind = get(lag, c) * (1.0 / h);
    for (int m = 0; m < POWERS; ++m) {  // f + lag f': A_m + lag (m / h) A_(m-1), B alike
      const Lanes plain_A = get(A + m * stride, c) * (h * h);
      const Lanes plain_B = m ? before_A * (m / h) : get(step + stride, c);
      put(A + m * stride, c, plain_A + behind * double(m) * before_A);
      put(B + m * stride, c, plain_B + behind * double(m) * before_B);
      before_A = plain_A, before_B = plain_B;
    }
  }
}

}  // namespace flexura
