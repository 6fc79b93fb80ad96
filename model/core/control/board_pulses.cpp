// The firmware's names would meet the core's: CMake compiles this file and the firmware's sources
// with their namespace renamed.
#include "control/board_pulses.hpp"

#include <algorithm>

#include "fixed_point_config.h"
#include "pid.cpp"
#include "step_generator.h"
#include "trajectory_player.h"

namespace board {

namespace fw = flexura;

namespace {

constexpr std::int32_t kRateOfStep = 268435;  // rig.cpp: 1/4096 microstep a tick in 1 microstep/s

fw::Knot knot_of(const KnotRow &row) {
  fw::Knot knot;
  for (int j = 0; j < 2; ++j) {
    knot.position[j] = static_cast<std::int32_t>(row.position[j]);
    knot.velocity[j] = static_cast<std::int16_t>(row.velocity[j]);
  }
  return knot;
}

}  // namespace

int settings_count() { return fw::kConfigItems; }
int counts_per_tick() { return fw::kTickCounts; }

Pulses step_pulses(const std::vector<float> &settings, bool open_loop, int period_log2,
                   const std::vector<KnotRow> &knots, std::int32_t given, int ticks) {
  Pulses out;
  fw::Config config = fw::default_config();
  std::copy(settings.begin(), settings.end(), config.values);
  fw::FixedPointConfig fixed;
  const std::uint8_t wrong = fw::to_fixed_point(config, fixed);
  if (wrong != fw::kAllValid) {
    out.wrong_setting = wrong;
    return out;
  }
  fw::TrajectoryPlayer player;
  fw::Pid pid;
  fw::StepGenerator steps;
  player.clear();
  pid.start(0);
  steps.start(given);
  std::size_t next = 0;
  const auto feed = [&] {
    for (; next < knots.size() && player.room(); ++next)
      player.add(knot_of(knots[next]), next + 1 == knots.size());
  };
  feed();
  player.start(static_cast<std::uint8_t>(period_log2), !open_loop, fixed.setpoint_filter);
  fw::Tick target = {{knot_of(knots[0]).position[0], knot_of(knots[0]).position[1]}};
  const fw::PidGains &gains = fixed.gains[1];
  for (int tick = 1; tick <= ticks; ++tick) {
    feed();
    player.prepare();
    const std::int32_t before = target.of[1];
    player.advance(target);
    if (open_loop) {
      pid.track(gains, fw::multiply_high(kRateOfStep, static_cast<std::int16_t>(target.of[1])));
    } else {
      pid.update(gains, {fw::subtract(target.of[1], steps.position()),
                         static_cast<std::int16_t>(pid.output() >> 4),
                         fw::saturate16(target.of[1] - before), 0});
    }
    fw::StepPlan plan;
    steps.plan(pid.output(), plan);
    for (int k = 0; k < plan.count; ++k) {
      out.at.push_back(std::int64_t(tick + 1) * fw::kTickCounts + plan.at[k]);
      out.direction.push_back(plan.up ? 1 : -1);
    }
  }
  return out;
}

}  // namespace board
