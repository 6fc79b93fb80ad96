// What a run gives: rows of times, states and drive forces.
#pragma once
#include <cstddef>
#include <vector>

namespace flexura {

struct Record {
  int rows = 0, size = 0, joints = 0;
  std::vector<double> t;      // (rows)
  std::vector<double> state;  // (rows, size): q, v, accounts
  std::vector<double> drive;  // (rows, joints): forces of the drives

  void open(std::size_t most, int state_size, int joint_count) {
    size = state_size, joints = joint_count, rows = 0;
    t.assign(most, 0.0), state.assign(most * std::size_t(size), 0.0),
        drive.assign(most * std::size_t(joints), 0.0);
  }
};

}  // namespace flexura
