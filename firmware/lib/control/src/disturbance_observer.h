// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The disturbance observer of one joint.
//
// The nominal joint is u = jo q'' + bo q' + d, in units of the output (147). In every second tick
// k, with a the factor of the first-order filter Q over 2 T and c = jo a / (2 T (1 - a)):
//
//   x_k = u_{k-1} + (c - bo) q'_k,   z_k = z_{k-2} + a (x_k - z_{k-2})                     (148)
//   d^_k = z_k - c q'_k                                                                    (149)
//
// That is Q of u - bo q' - jo q'' without a difference of rates. The law adds d^ to u: pid.h.
#pragma once
#include "numbers.h"

namespace flexura {

// Gains by the nominal joint (147). The comments give the board's scales; in the model all is in
// SI units.
template <class N>
struct ObserverGainsOf {
  typename N::Gain moving = 0;    // c - bo; Q8, u per (count / tick)
  typename N::Gain inertia = 0;   // c, likewise
  typename N::Factor filter = 0;  // a; Q16; 0: there is no observer
};

template <class N>
class DisturbanceObserverOf {
 public:
  using Value = typename N::Value;
  using Wide = typename N::Wide;

  void start() { filtered_ = 0; }
  // d^ (149) as Q16 of u, from the output of the tick before and the rate q' [counts / 256 per
  // tick].
  Wide update(const ObserverGainsOf<N> &gains, Value output, Value rate) {
    if (gains.filter == 0) return 0;
    const Wide given = N::plus(N::widened(output), N::product(gains.moving, rate));
    filtered_ = N::filtered(filtered_, given, gains.filter);
    return N::less(filtered_, N::product(gains.inertia, rate));
  }

 private:
  Wide filtered_ = 0;  // z, Q16 of u
};

using ObserverGains = ObserverGainsOf<BoardNumbers>;
using DisturbanceObserver = DisturbanceObserverOf<BoardNumbers>;

}  // namespace flexura
