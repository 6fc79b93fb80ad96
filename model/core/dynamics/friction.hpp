// Friction in the joints (57): viscous c eta', and Coulomb friction f tanh(eta' / v0), smoothed
// over the rate v0.
#pragma once
#include "numbers/scalars.hpp"

namespace flexura {

constexpr double COULOMB_SPEED = 1e-3;  // v0 [rad/s or m/s]

// Coulomb friction f tanh(eta' / v0) [N m or N], of (57), at the rate eta' = speed.
template <class Real>
inline Real coulomb_friction(const Real &f, const Real &speed, double v0 = COULOMB_SPEED) {
  return f * tanh(speed * (1.0 / v0));
}

// Coulomb friction linearised about the rate of an implicit stage's last iterate (49): friction =
// value + slope (eta' - speed). The tangent if the rate has changed by less than 0.3 v0 since the
// iterate before, else the line through zero, which never overshoots.
template <class Real>
struct LinearFriction {
  Real value, slope;
};
template <class Real>
inline LinearFriction<Real> linear_coulomb_friction(const Real &f, const Real &speed,
                                                    const Real &change, double v0) {
  const Real x = speed * (1.0 / v0), r = tanh(x), steep = f * (1.0 / v0);
  const Real chord = choose_less(abs(x), Real(1e-4), steep, steep * (r / x)),
             tangent = steep * (1.0 - r * r);
  return {f * r, choose_less(change, Real(0.3), tangent, chord)};
}

}  // namespace flexura
