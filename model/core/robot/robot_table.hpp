// Robots of one topology as rows of numbers: how Python hands them over
// (flexura/system/constants.py).
#pragma once
#include <cstdint>

#include "robot/robot.hpp"

namespace flexura {

// Lengths of rows. counts: kind of the joint, locked, elements, modes (-1: all), intervals of the
// material. numbers: length, mass, centre, inertia, alpha, beta; of the joint angle, start, hub
// mass, hub inertia, rotor, viscous, coulomb, low, high. material: from, to, mass per length,
// bending stiffness (8).
enum { COUNTS = 5, NUMBERS = 15, MATERIAL = 10 };

struct Table {
  int count = 1, links = 0, intervals = 0;  // intervals of all links together
  const std::int64_t *counts = nullptr;     // (links, COUNTS), the same for all robots
  const double *numbers = nullptr;          // (count, links, NUMBERS)
  const double *material = nullptr;         // (count, intervals, MATERIAL)
  const double *gravity = nullptr;          // (count, 2)
  const double *payload = nullptr;          // (count, 2): mass, inertia
};

// Robot k of the table. Throws std::invalid_argument if the counts ask for other rows of material
// than there are.
Robot robot_of(const Table &table, int k);

}  // namespace flexura
