// Step pulses of joint 2 by the firmware's own code: trajectory player, fixed-point PID, step
// generator.
#pragma once
#include <cstdint>
#include <vector>

namespace board {

// One knot of a trajectory: positions [counts / 256] and velocities [counts / 256 per tick] of two
// joints; in open loop voltage [mV] and rate [microsteps/s] stand in `velocity`.
struct KnotRow {
  std::int64_t position[2], velocity[2];
};

struct Pulses {
  std::vector<std::int64_t> at;         // counts of the step timer from the trajectory's start
  std::vector<std::int64_t> direction;  // 1 or -1
  int wrong_setting = -1;               // number of a setting that the firmware refuses
};

// Number of settings of the board, and counts of the step timer in a control tick.
int settings_count();
int counts_per_tick();

// The pulses of `ticks` control ticks, `given` microsteps having been given before. `settings` in
// SI units, in the order of the protocol's declaration. Joint 2 is controlled on its own pulses
// without the deflection; `knots` has at least one.
Pulses step_pulses(const std::vector<float> &settings, bool open_loop, int period_log2,
                   const std::vector<KnotRow> &knots, std::int32_t given, int ticks);

}  // namespace board
