// What cannot be assembled is refused by its link and key; robots that are assembled together.
#include "link/assembly.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "check.hpp"
#include "robot/input_fault.hpp"

using namespace flexura;

namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();

Link strip(double length, int elements, int modes = -1) {
  Link link;
  link.length = length, link.elements = elements, link.modes = modes;
  Interval all;
  all.to = length, all.mass[0] = 0.2, all.stiffness[0] = 0.4;
  link.material = {all};
  return link;
}
Link rigid(double length, double mass) {
  Link link;
  link.length = length, link.mass = mass, link.centre = 0.5 * length,
  link.inertia = mass * length * length / 12.0;
  return link;
}
Robot of(std::vector<Link> links) {
  Robot robot;
  robot.links = std::move(links);
  return robot;
}

// Link and key of what is refused; "": nothing is.
std::string refused(const Robot &robot) {
  try {
    assemble(robot);
  } catch (const Fault &fault) {
    return std::to_string(fault.link) + " " + fault.key;
  }
  return "";
}

}  // namespace

TEST("a robot needs a link, a link that bends a length, a material and at most 14 modes") {
  CHECK(refused(of({})) == "-1 link");
  CHECK(refused(of({strip(0.5, 2)})) == "");
  CHECK(refused(of({rigid(0.2, 1.0), strip(0.0, 2)})) == "1 length_m");
  CHECK(refused(of({strip(std::nan(""), 2)})) == "0 length_m");
  Link bare = strip(0.5, 2);
  bare.material.clear();
  CHECK(refused(of({bare})) == "0 length_m");
  CHECK(refused(of({strip(0.5, 8, 14)})) == "");
  CHECK(refused(of({strip(0.5, 8, 15)})) == "0 modes");
}

TEST("a joint that moves no mass, or one that is not finite, is refused; a locked one is not") {
  Robot robot = of({rigid(0.2, 1.0), rigid(0.3, 0.0)});
  CHECK(refused(robot) == "1 joint");
  robot.links[1].joint.locked = true;
  CHECK(refused(robot) == "");
  robot.links[1].joint.locked = false;
  for (double mass : {0.1, INFINITE, std::nan("")}) {
    robot.payload_mass = mass;
    CHECK(refused(robot).empty() == std::isfinite(mass));
  }
  robot.payload_mass = 1e308, robot.links[1].length = 3.0;  // its moment of inertia is not finite
  CHECK(refused(robot) == "1 joint");
  Link massless = strip(0.5, 2);
  massless.material[0].mass[0] = 0.0;
  CHECK(refused(of({massless})) == "0 joint");
  robot = of({massless});
  robot.links[0].joint.hub_inertia = 1e-3, robot.payload_mass = 0.1, robot.payload_inertia = 1e-4;
  CHECK(refused(robot) == "");
}

TEST("an infinite hub is refused, whatever its joint") {
  for (JointKind kind : {JointKind::revolute, JointKind::slider}) {
    Robot robot = of({rigid(0.2, 1.0)});
    robot.links[0].joint.kind = kind;
    CHECK(refused(robot) == "");
    robot.links[0].joint.hub_mass = robot.links[0].joint.hub_inertia = INFINITE;
    CHECK(refused(robot) == "0 joint");
  }
}

TEST("beyond a transmission there must be a mass") {
  Robot robot = of({rigid(0.3, 0.0)});
  robot.links[0].joint.has_hub = robot.links[0].joint.elastic = true;
  robot.links[0].joint.transmission_stiffness = 20.0, robot.links[0].joint.rotor = 1e-3;
  CHECK(refused(robot) == "0 joint.transmission");
  robot.links[0].joint.hub_inertia = INFINITE;
  CHECK(refused(robot) == "0 joint.transmission");
  robot.links[0].joint.hub_inertia = 0.0, robot.payload_mass = 1e308, robot.links[0].length = 3.0;
  CHECK(refused(robot) == "0 joint.transmission");
  robot.payload_mass = 0.0;
  robot.links[0].joint.hub_inertia = 1e-3;
  CHECK(refused(robot) == "");
}

TEST("robots of unlike spaces of modes are assembled together with the numbers of each alone") {
  Robot robots[4] = {of({strip(0.5, 8, 3)}), of({strip(0.6, 8, 3)}), of({strip(0.4, 8, 3)}),
                     of({strip(0.5, 8, 15)})};
  robots[1].links[0].material[0].mass[1] = -0.1;  // not uniform: it takes more shapes
  const Robot *pointers[4];
  Model<double> models[4];
  std::unique_ptr<Fault> faults[4];
  for (int k = 0; k < 4; ++k) pointers[k] = &robots[k];
  assemble(pointers, 4, models, faults);
  CHECK(faults[3] && faults[3]->key == "modes");
  for (int k = 0; k < 3; ++k) CHECK(!faults[k] && models[k].numbers == assemble(robots[k]).numbers);
  robots[1] = of({strip(0.5, 8, 4)});  // as many shapes, another number of modes: no pack either
  assemble(pointers, 2, models, faults);
  for (int k = 0; k < 2; ++k) CHECK(!faults[k] && models[k].numbers == assemble(robots[k]).numbers);
  for (int k = 0; k < 2; ++k) robots[k].links[0].lumps = {{0.2, 0.1, 1e-4}};  // shapes alike
  assemble(pointers, 2, models, faults);
  for (int k = 0; k < 2; ++k) CHECK(!faults[k] && models[k].numbers == assemble(robots[k]).numbers);
  for (int modes : {-1, 3}) {  // a pack of three, with a slider on them
    for (int k = 0; k < 3; ++k) {
      robots[k] = of({strip(0.5 + 0.1 * k, 4, modes), rigid(0.1, 0.2)});
      robots[k].links[1].joint.kind = JointKind::slider, robots[k].links[1].joint.start = 0.3;
    }
    assemble(pointers, 3, models, faults);
    for (int k = 0; k < 3; ++k)
      CHECK(!faults[k] && models[k].numbers == assemble(robots[k]).numbers);
  }
  robots[0] = of({});
  assemble(pointers, 1, models, faults);
  CHECK(faults[0] && faults[0]->key == "link");
}

TEST("elements end at lumps as long as there are elements; a lump without a node weighs as much") {
  for (int elements : {1, 2, 3, 6}) {
    Robot robot = of({strip(0.6, elements)});
    robot.links[0].lumps = {{0.2, 0.1, 0.0}, {0.205, 0.05, 0.0}, {0.4, 0.3, 0.0}};
    const Model<double> model = assemble(robot);
    CHECK(model.n == 1 + 2 * elements);
    double mass = 0.0, ends = 0.0, lumps = 0;
    for (const Piece<double> &piece : model.pieces) {
      mass += piece.mass, ends += piece.length;
      for (const Lump &lump : robot.links[0].lumps) lumps += std::fabs(ends - lump.at) < 1e-12;
    }
    CHECK_NEAR(mass, 0.6 * 0.2 + 0.45, 1e-12);
    CHECK_NEAR(ends, 0.6, 1e-15);
    CHECK(lumps == std::min(2, elements - 1));
  }
}
