// The file of an FMU that holds its robot: resources/robot.bin, which flexura/interchange writes.
//
// Little-endian numbers of eight bytes. Its head is the word "flexura1" and nine whole numbers:
// bytes of the token, links, intervals of material, lumped masses, unknowns, sensors, stations of a
// link, whether it starts in static equilibrium, 0. Then come the token, filled up with zeros to
// eights; counts, numbers, material, lumps, gravity and payload of robot_table.hpp; limits (links,
// 2); the relative tolerance; and of each sensor 3 + n numbers: 0 for a deflection or 1, its link
// from 0, its place [m], and weights of the unknowns, whose sum the sensor shows if it is 1.
#pragma once
#include <string>
#include <vector>

#include "robot/robot.hpp"

namespace flexura {

struct LinkSensor {
  bool weighted = false;  // shows a sum of the unknowns (slope, strain); else a deflection
  int link = 0;
  double at = 0.0;              // [m]
  std::vector<double> weights;  // (n)
};

struct RobotFile {
  std::string token;  // of the model description that it belongs to
  Robot robot;
  std::vector<double> limits;  // (links, 2)
  int unknowns = 0, stations = 0;
  bool in_equilibrium = false;  // at the start
  double rtol = 1e-6;
  std::vector<LinkSensor> sensors;
};

// Throws std::runtime_error, with the path, if the file is not there or is another one.
RobotFile read_robot_file(const std::string &path);

}  // namespace flexura
