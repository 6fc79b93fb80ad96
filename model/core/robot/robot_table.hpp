// Robots of one topology as rows of numbers: how Python hands them over
// (flexura/system/constants.py).
#pragma once
#include <cstdint>

#include "robot/robot.hpp"

namespace flexura {

// Lengths of rows. counts: kind of the joint, locked, elements, modes (-1: all), intervals of the
// material, lumped masses, hub (a sum of OfHub), centres (a sum of OffLine). numbers: length, mass,
// centre, inertia, alpha, beta; of the joint angle, start, hub mass, hub inertia, rotor, viscous,
// coulomb, low, high, spring, its rest, hub radius, stiffness and damping of the transmission;
// centre across. material: from, to, mass per length, bending stiffness (8). lumps: at, mass,
// inertia.
enum { COUNTS = 8, NUMBERS = 21, MATERIAL = 10, LUMP = 3, PAYLOAD = 4 };
enum OfHub { HUB_RADIUS = 1, HUB_TRANSMISSION = 2 };
enum OffLine { OFF_LINK = 1, OFF_PAYLOAD = 2 };  // the latter in the last link's row

struct Table {
  int count = 1, links = 0, intervals = 0, lumps = 0;  // the last two of all links together
  const std::int64_t *counts = nullptr;                // (links, COUNTS), the same for all robots
  const double *numbers = nullptr;                     // (count, links, NUMBERS)
  const double *material = nullptr;                    // (count, intervals, MATERIAL)
  const double *lump = nullptr;                        // (count, lumps, LUMP)
  const double *gravity = nullptr;                     // (count, 2)
  const double *payload = nullptr;  // (count, PAYLOAD): mass, inertia, centre along and across
};

// Robot k of the table. Throws std::invalid_argument if the counts ask for other rows of material
// or lumps than there are.
Robot robot_of(const Table &table, int k);

}  // namespace flexura
