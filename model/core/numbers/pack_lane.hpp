// Single lanes of a number: a double is a pack of one.
#pragma once
#include "numbers/scalars.hpp"

namespace flexura {

template <class Real>
struct LanesOf;
template <>
struct LanesOf<double> {
  static constexpr int value = 1;
};
template <int N>
struct LanesOf<Pack<N>> {
  static constexpr int value = N;
};

inline double lane(const double &x, int) { return x; }
template <int N>
inline double lane(const Pack<N> &x, int k) {
  return x[k];
}
inline void set_lane(double &x, int, double value) { x = value; }
template <int N>
inline void set_lane(Pack<N> &x, int k, double value) {
  x.set(k, value);
}

// Where `which` is 1, the numbers `from` (count) take the place of those in `to`; where it is 0
// these stay.
template <class Real>
inline void take(const Real &which, const Real *from, Real *to, int count) {
  for (int k = 0; k < count; ++k) to[k] = choose_less(Real(0.5), which, from[k], to[k]);
}

}  // namespace flexura
