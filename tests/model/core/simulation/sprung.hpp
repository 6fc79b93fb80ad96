// What the tests of the choice of a method share.
#pragma once
#include "plants.hpp"

namespace flexura {

inline Segment constant(double t0, double value) {
  return {t0, {value, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}

// A joint and an elastic unknown, uncoupled: the joint has a spring of 9 and a damper.
inline Masses<double> sprung(double elastic, double damping = 0.0) {
  Masses<double> plant(1, 1);
  plant.stiffness = {9.0, elastic}, plant.viscous[0] = damping;
  return plant;
}

}  // namespace flexura
