// Robots from rows of numbers: counts that ask for more rows than there are are refused.
#include "robot/robot_table.hpp"

#include <stdexcept>

#include "check.hpp"

using namespace flexura;

namespace {

// One link that bends, of one row of material, with one lump.
struct Rows {
  std::int64_t counts[COUNTS] = {0, 0, 2, -1, 1, 1, 0, 0};
  double numbers[NUMBERS] = {0.5}, material[MATERIAL] = {0.0, 0.5, 0.2},
         lump[LUMP] = {0.25, 0.1, 1e-4}, gravity[2] = {0.0, -9.81}, payload[PAYLOAD] = {0.3};

  Table table() const { return {1, 1, 1, 1, counts, numbers, material, lump, gravity, payload}; }
};

bool refused(const Rows &rows) {
  try {
    robot_of(rows.table(), 0);
  } catch (const std::invalid_argument &) {
    return true;
  }
  return false;
}

}  // namespace

TEST("a row a number: length, material, lump, payload") {
  const Rows rows;
  const Robot robot = robot_of(rows.table(), 0);
  CHECK(robot.links.size() == 1 && robot.links[0].length == 0.5 && robot.payload_mass == 0.3);
  CHECK(robot.links[0].material[0].mass[0] == 0.2 && robot.links[0].lumps[0].mass == 0.1);
  CHECK(!robot.links[0].joint.has_hub && !robot.payload_off_tip && !robot.links[0].off_line);
}

TEST("more material or lumps than there are rows is refused") {
  Rows rows;
  CHECK(!refused(rows));
  rows.counts[4] = 2;
  CHECK(refused(rows));
  rows.counts[4] = 1, rows.counts[5] = 2;
  CHECK(refused(rows));
}
