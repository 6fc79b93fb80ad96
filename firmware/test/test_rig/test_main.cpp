// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the rig tells, and what it keeps from one tick, run and command to the next.
#include "bench.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static Inputs &still() {
  Inputs &in = rig.inputs();
  in.moved[0] = in.moved[1] = in.stepped = 0;
  in.missed[0] = in.missed[1] = 0;
  memset(in.edges, 0, sizeof in.edges);
  return in;
}

static Result reference(int32_t position_1, int32_t position_2, int32_t steps) {
  const Reference here = {position_1, position_2, steps};
  return ask(Reference::kCode, &here);
}

static Result arm_as(Mode mode) {
  const Arm arm = {static_cast<uint8_t>(mode)};
  return ask(Arm::kCode, &arm);
}

// Eight knots of the same drives, and the start after so many ticks.
static void start_drives(int16_t voltage, int16_t rate, uint8_t at) {
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) {
    drives.voltage[k] = voltage;
    drives.rate[k] = rate;
  }
  const Start start = {at};
  CHECK(ask(Drives::kCode, &drives) == Result::ok && ask(Start::kCode, &start) == Result::ok);
}

static bool is_set(const Telemetry &report, Flag flag) {
  return report.flags >> static_cast<uint8_t>(flag) & 1;
}

// Joint 2 at its greatest rate, joint 1 at one volt.
static void a_report_has_all_that_the_tick_knew() {
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.rate_max_2_rad_s() = 7.8f;
  config.acceleration_max_2_rad_s2() = 1e4f;
  config.position_max_2_rad() = 100;
  config.speed_max_2_rad_s() = 1000;
  begin_with(config);
  const uint8_t limits = 1 << static_cast<uint8_t>(Flag::limit_low);
  rig.inputs().switches = limits;
  Telemetry report;
  rig.tick(out);
  rig.report(report);
  CHECK(report.state == static_cast<uint8_t>(State::idle) && report.fault == 0);
  CHECK(report.flags == limits && report.voltage == 0 && report.rate == 0 && report.tick == 2);
  rig.inputs().switches = 0;
  CHECK(reference(10, 30, 40) == Result::ok && arm_as(Mode::open_loop) == Result::ok);
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) {
    drives.voltage[k] = 500;
    drives.rate[k] = 3971;
  }
  CHECK(ask(Drives::kCode, &drives) == Result::ok);
  rig.report(report);
  CHECK(report.buffered == 8);
  const Start start = {5};
  CHECK(ask(Start::kCode, &start) == Result::ok);
  uint8_t pulses = 0;
  for (uint8_t k = 0; k < 20; ++k) {
    Inputs &in = still();
    in.moved[0] = 2;
    in.moved[1] = 1;
    in.missed[1] = k == 7 || k == 9 ? 2 : 0;
    in.stepped = static_cast<int8_t>(out.steps.count);
    pulses = static_cast<uint8_t>(pulses + in.stepped);
    in.edges[0][0] = in.edges[0][1] = in.edges[1][0] = in.edges[1][1] = 1;
    rig.prepare();
    rig.tick(out);
  }
  rig.report(report);
  CHECK(report.state == static_cast<uint8_t>(State::running) && report.tick == 22);
  CHECK(report.position_1 == 50 && report.position_2 == 50 && report.steps == 40 + pulses);
  CHECK(pulses > 70 && report.missed == 4 && report.buffered == 6);
  CHECK(report.setpoint_1 == 500 && report.setpoint_2 == 3971);
  // 500 / 1024 x 5 V x 4.9 = 11.963 V.
  CHECK(report.flex == 3500 && report.supply >= 11960 && report.supply <= 11966);
  CHECK(report.voltage == 500 && report.voltage_2 == 0);
  // The rate in whole units of 1/4096 microstep a tick: 3971 microsteps/s are 16265 of them.
  CHECK(report.rate == 3970);
  CHECK(is_set(report, Flag::bridge_enabled) && is_set(report, Flag::driver_enabled));
  CHECK(is_set(report, Flag::referenced) && !is_set(report, Flag::saturated));
  rig.trip(Fault::overrun);
  const uint32_t tripped = report.tick;
  still();
  tick(3);
  rig.report(report);
  CHECK(report.fault == static_cast<uint8_t>(Fault::overrun) && report.fault_tick == tripped);
  CHECK(report.tick == tripped + 3 && report.voltage == 0 && report.rate == 0);
  CHECK(!is_set(report, Flag::bridge_enabled) && !is_set(report, Flag::driver_enabled));
  CHECK(rig.now() == report.tick);
}

// At 60 V a unit of output is two of what a report counts in.
static void without_a_drive_a_report_has_no_voltage() {
  Config config = default_config();
  config.supply_V() = 60;
  begin_with(config);
  Telemetry report;
  rig.report(report);
  CHECK(report.voltage == 0 && report.voltage_2 == 0 && report.rate == 0);
}

// A report that is rounded down lets a simulation of the run drift: 1 mV is 13 um/s on a lead
// screw.
static void a_report_has_the_voltage_that_was_asked_for() {
  const int16_t asked[] = {1, -1, 2, -2, 333, -333, 500, -500, 1501, -1501, 2000, -2000};
  for (const int16_t voltage : asked) {
    Config config = default_config();
    config.lost_step_rad() = 10;
    config.voltage_slew_V_s() = 1e4f;
    begin_with(config);
    CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::open_loop) == Result::ok);
    start_drives(voltage, 0, 5);
    tick(16);
    Telemetry report;
    rig.report(report);
    CHECK(report.voltage == voltage);
  }
}

// 1000 microsteps/s, and a brake of 10 rad/s2 x 1 ms = 5.09 microsteps/s a tick.
static void joint_2_brakes_after_a_halt_and_stands_after_a_stop() {
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.rate_max_2_rad_s() = 7;
  config.position_max_2_rad() = 100;
  for (uint8_t stops = 0; stops < 2; ++stops) {
    begin_with(config);
    CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::open_loop) == Result::ok);
    start_drives(0, 1000, 6);
    for (uint16_t k = 0; k < 300 || (k < 400 && out.steps.count == 0); ++k) {
      if (k % 50 == 0) rig.host_spoke();
      tick();
    }
    CHECK(out.steps.count == 1);
    CHECK(out.on && ask(stops ? Stop::kCode : Halt::kCode) == Result::ok);
    Telemetry report;
    if (stops) {  // the steps that were planned are not given
      still();
      rig.tick(out);
      CHECK(!out.on && out.steps.count == 0);
      CHECK(arm_as(Mode::open_loop) == Result::ok);
      tick();
      rig.report(report);
      CHECK(out.on && out.steps.count == 0 && report.rate == 0);
    } else {
      tick(100);
      rig.report(report);
      CHECK(report.rate > 480 && report.rate < 500);
      tick(100);
      rig.report(report);
      CHECK(report.rate == 0);
    }
  }
}

static void a_refusal_says_the_state_and_stop_forgets_the_trajectory() {
  uint16_t detail = 99;
  arm(Mode::position);
  const Arm again = {2};
  CHECK(rig.command(Arm::kCode, reinterpret_cast<const uint8_t *>(&again), detail) ==
        Result::wrong_state);
  CHECK(detail == static_cast<uint16_t>(State::armed));
  Setpoints points = {};
  points.count = 4;
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Stop::kCode) == Result::ok);
  Telemetry report;
  rig.report(report);
  CHECK(report.buffered == 0);
}

// Pulses and encoder of joint 2 may differ by a tolerance: 5205/256 microsteps, and 5206.
static void a_reference_agrees_with_itself_to_the_count() {
  Config config = default_config();
  for (uint8_t k = 0; k < 2; ++k) {
    const int32_t limit = 5205 + k;
    config.lost_step_rad() = static_cast<float>(limit) / (509.29582f * 256.0f);
    begin_with(config);
    CHECK(rig.fixed().limits.lost == limit && rig.fixed().ratio == 87381);
    // 87381 / 256 = 341.3, rounded down.
    const int32_t count = k ? -1 : 1, steps = k ? 19 : -19;
    CHECK(reference(0, count, steps) == Result::ok);
    CHECK(reference(0, count, steps + count * -1) == Result::out_of_range);
    CHECK(reference(0, 0, 20) == Result::ok && reference(0, 0, -20) == Result::ok);
    CHECK(reference(0, 0, 21) == Result::out_of_range);
    CHECK(reference(0, 0, -21) == Result::out_of_range);
  }
  // As many counts as microsteps: what is too far is refused by itself.
  config.stepper_counts_per_rad() = config.stepper_steps_per_rad();
  begin_with(config);
  const int32_t far = 1L << 22;
  CHECK(reference(0, far - 1, far - 1) == Result::ok);
  CHECK(reference(0, far, far - 1) == Result::out_of_range);
  CHECK(reference(0, far - 1, far) == Result::out_of_range);
  CHECK(reference(0, -far, 1 - far) == Result::out_of_range);
  // What was told is where the joints are: 300 counts are 399.99 microsteps. 0.76 may be lost.
  config = default_config();
  config.lost_step_rad() = 0.0015f;
  config.position_max_2_rad() = 2;
  begin_with(config);
  CHECK(rig.fixed().limits.lost == 196);
  CHECK(reference(7, 300, 400) == Result::ok && arm_as(Mode::position) == Result::ok);
  still();
  for (uint8_t k = 0; k < 5; ++k) rig.tick(out);
  Telemetry report;
  rig.report(report);
  CHECK(rig.fault() == Fault::none);
  CHECK(report.position_1 == 7 && report.position_2 == 300 && report.steps == 400);
}

// A count of joint 2 is 4/3 microsteps = 341/256: more than 340 is lost, 342 is not.
static void steps_are_lost_to_the_fraction() {
  for (uint8_t k = 0; k < 2; ++k) {
    Config config = default_config();
    config.lost_step_rad() = (k ? 342.0f : 340.0f) / (509.29582f * 256.0f);
    begin_with(config);
    CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
    still().moved[1] = 1;
    rig.tick(out);
    CHECK(rig.fault() == (k ? Fault::none : Fault::stall_2));
  }
}

static void the_stop_is_open_for_fifty_ticks() {
  healthy();
  Inputs &in = still();
  for (uint8_t ticks = 49; ticks <= 50; ++ticks) {
    CHECK(rig.stop_trial() == StopTrial::untried);
    in.switches = 1 << static_cast<uint8_t>(Flag::emergency_stop);
    for (uint8_t k = 0; k < ticks; ++k) rig.tick(out);
    CHECK(rig.stop_trial() == (ticks < 50 ? StopTrial::untried : StopTrial::pressed));
    in.switches = 0;
    rig.tick(out);
  }
  CHECK(rig.stop_trial() == StopTrial::released && ask(Commission::kCode) == Result::ok);
}

static void what_a_run_left_does_not_reach_the_next() {
  // The drive of a run that was stopped: with it, the edges would be those of a broken wire.
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.stall_voltage_V() = 0;
  begin_with(config);
  CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::open_loop) == Result::ok);
  start_drives(3000, 0, 5);
  tick(10);
  CHECK(out.duty[0] > 100 && ask(Stop::kCode) == Result::ok);
  tick(2);
  CHECK(arm_as(Mode::open_loop) == Result::ok);
  still().edges[0][0] = 250;
  rig.tick(out);
  CHECK(rig.fault() == Fault::none);
  // The error of a tick in which only joint 2 was judged is not judged after a halt.
  for (uint8_t wait = 0; wait < 2; ++wait) {
    config = default_config();
    config.lost_step_rad() = 10;
    config.following_max_1_m() = 0.001f;  // 80 counts
    config.speed_max_1_m_s() = 10;
    begin_with(config);
    CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
    Setpoints points = {};
    points.count = 1;
    points.final = 1;
    const Start start = {5};
    CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
    tick(static_cast<uint16_t>(4 + wait));
    still().moved[0] = 100;
    rig.inputs().edges[0][0] = rig.inputs().edges[0][1] = 50;
    rig.tick(out);
    if (rig.state() == State::running) {
      CHECK(ask(Halt::kCode) == Result::ok);
      tick(4);
      CHECK(rig.fault() == Fault::none);
    } else {
      CHECK(rig.fault() == Fault::following_1);
    }
  }
}

static void armed_is_at_rest() {
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.kp_1_V_m() = 9e3f;
  config.voltage_slew_V_s() = 201.5f;  // 215/16 of a PWM count in a tick
  begin_with(config);
  CHECK(rig.fixed().gains[0].slew == 215);
  CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
  for (uint16_t k = 0; k < 3200; ++k) {  // a rate of 1/4096 would be a step by now
    if (k % 50 == 0) rig.host_spoke();
    still();
    rig.tick(out);
    CHECK(out.on && out.duty[0] == 0 && out.steps.count == 0);
  }
  Setpoints points = {};
  points.count = 1;
  points.final = 1;
  points.position_1[0] = 100L * 256;  // 1.25 mm x 9 kV/m: the slew holds it back
  const Start start = {0};
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  rig.prepare();
  rig.tick(out);
  CHECK(out.duty[0] == (215 + 8) / 16);
}

// Joint 2 by its pulses, with kd alone: u = kd (r' - q') and q' = u, so u = r' kd / (1 + kd).
static void the_rate_of_joint_2_is_that_of_its_pulses() {
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.kp_2_1_s() = 0;
  config.kv_2() = 0;
  config.kd_2() = 0.5f;
  config.following_max_2_rad() = 1000;
  begin_with(config);
  CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
  Setpoints points = {};
  points.count = 4;
  for (uint8_t k = 0; k < 4; ++k) {
    points.position_2[k] = 77L * 64 * k;
    points.velocity_2[k] = 77;
  }
  const Start start = {6};
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  for (uint8_t k = 0; k < 150; ++k) {
    if (k % 50 == 0) rig.host_spoke();
    tick();
  }
  Telemetry report;
  rig.report(report);
  CHECK(report.rate >= 99 && report.rate <= 101);  // 77/256 microsteps a tick, a third
}

static Result ask_for(uint8_t code, const void *fields, uint16_t &detail) {
  return rig.command(code, static_cast<const uint8_t *>(fields), detail);
}

static void refusals_carry_their_number() {
  uint16_t detail = 0;
  healthy();
  rig.inputs().switches = 1;
  for (uint8_t k = 0; k < 60; ++k) rig.tick(out);
  CHECK(ask_for(Commission::kCode, nullptr, detail) == Result::stop_unproven);
  CHECK(detail == static_cast<uint16_t>(StopTrial::pressed));
  begin(default_config(), 1, 5);  // proven for another firmware
  rig.inputs().flex = 3500;
  rig.inputs().supply = 500;
  rig.inputs().switches = 0;
  tick();
  const Arm arming = {2};
  rig.inputs().switches = 1;
  for (uint8_t k = 0; k < 60; ++k) rig.tick(out);
  rig.inputs().switches = 0;
  rig.tick(out);
  CHECK(ask_for(Arm::kCode, &arming, detail) == Result::stop_unproven);
  CHECK(detail == static_cast<uint16_t>(StopTrial::released));
  arm(Mode::position);
  const Start start = {3}, slow = {7};
  CHECK(ask_for(Start::kCode, &start, detail) == Result::not_ready && detail == 0);
  Setpoints points = {};
  points.count = 1;
  CHECK(ask(Setpoints::kCode, &points) == Result::ok);
  CHECK(ask_for(Start::kCode, &start, detail) == Result::not_ready && detail == 1);
  points.first = 1;
  CHECK(ask(Setpoints::kCode, &points) == Result::ok);
  points.first = 9;
  CHECK(ask_for(Setpoints::kCode, &points, detail) == Result::wrong_index && detail == 2);
  CHECK(ask(Start::kCode, &slow) == Result::out_of_range);
  CHECK(ask(Start::kCode, &start) == Result::ok);
  arm(Mode::open_loop);
  Drives drives = {};
  drives.count = 9;
  CHECK(ask(Drives::kCode, &drives) == Result::out_of_range);
}

// The ends of travel and of what a first set-point may be away from the joints: allowed, one beyond
// not.
static void set_points_to_the_end_and_no_further() {
  arm(Mode::position);
  const FixedPointConfig &fixed = rig.fixed();
  for (uint8_t j = 0; j < 2; ++j)
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      const int32_t end = sign < 0 ? fixed.span_low[j] : fixed.span_high[j];
      Setpoints points = {};
      points.count = 1;
      (j ? points.position_2 : points.position_1)[0] = end + sign;
      CHECK(ask(Setpoints::kCode, &points) == Result::out_of_range);
      (j ? points.position_2 : points.position_1)[0] = end;
      CHECK(ask(Setpoints::kCode, &points) == Result::ok);
      arm(Mode::position);
    }
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.position_max_1_m() = 1;
  config.position_min_1_m() = -1;
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    begin_with(config);
    CHECK(reference(sign * 8000L, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
    Setpoints points = {};
    points.count = 2;
    points.final = 1;
    points.position_1[0] = sign * 8000L * 256;  // far out, and from there a little
    points.position_1[1] = sign * 8001L * 256;
    CHECK(ask(Setpoints::kCode, &points) == Result::ok);
    for (uint8_t j = 0; j < 2; ++j)
      for (uint8_t beyond = 0; beyond < 2; ++beyond) {
        begin_with(config);
        CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
        points = Setpoints();
        points.count = 1;
        points.final = 1;
        (j ? points.position_2 : points.position_1)[0] =
            sign * (rig.fixed().limits.following[j] + beyond);
        CHECK(ask(Setpoints::kCode, &points) == Result::ok);
        const Start start = {0};
        CHECK(ask(Start::kCode, &start) == (beyond ? Result::out_of_range : Result::ok));
      }
  }
}

static void drives_end_with_the_final_one_and_begin_anew() {
  run_open_loop(500, 125, true);
  for (uint16_t k = 0; k < 100; ++k) tick();
  Telemetry report;
  rig.report(report);
  CHECK(report.rate == 124);  // 511 of 1/4096 microstep a tick
  for (uint16_t k = 0; k < 8 * 64 && rig.state() == State::running; ++k) {
    if (k % 50 == 0) rig.host_spoke();
    tick();
  }
  rig.report(report);
  CHECK(rig.state() == State::running && is_set(report, Flag::final));
  CHECK(report.setpoint_1 == 0 && report.setpoint_2 == 0);
  CHECK(ask(Halt::kCode) == Result::ok);
  Drives drives = {};
  drives.count = 2;
  drives.voltage[0] = drives.voltage[1] = 700;
  drives.rate[0] = drives.rate[1] = 50;
  const Start start = {5};
  for (uint8_t round = 0; round < 2; ++round) {
    CHECK(ask(Drives::kCode, &drives) == Result::ok && ask(Start::kCode, &start) == Result::ok);
    rig.report(report);  // before the first tick of it
    CHECK(report.setpoint_1 == 0 && report.setpoint_2 == 0 && !is_set(report, Flag::final));
    rig.host_spoke();
    tick(5);
    rig.report(report);
    CHECK(report.setpoint_1 == 700 && report.setpoint_2 == 50 && report.buffered == 1);
    CHECK(ask(Halt::kCode) == Result::ok);
    rig.report(report);
    CHECK(report.buffered == 0);
  }
  // After a fault and its clearing the old trajectory is gone, and the set-point with it.
  CHECK(ask(Drives::kCode, &drives) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  tick(5);
  rig.trip(Fault::speed_1);
  const Clear clear = {static_cast<uint8_t>(Fault::speed_1)};
  CHECK(ask(Clear::kCode, &clear) == Result::ok && arm_as(Mode::open_loop) == Result::ok);
  rig.report(report);
  CHECK(report.buffered == 0 && report.setpoint_1 == 0 && report.setpoint_2 == 0);
  CHECK(report.fault == 0 && report.state == static_cast<uint8_t>(State::armed));
}

static void settings_are_in_use_at_once_or_not_at_all() {
  healthy();
  uint16_t detail = 99;
  const int16_t limit = rig.fixed().gains[0].limit;
  ConfigWrite write = {static_cast<uint8_t>(Item::voltage_max_V), 61.0f};
  CHECK(ask_for(ConfigWrite::kCode, &write, detail) == Result::out_of_range);
  CHECK(detail == write.item && rig.fixed().gains[0].limit == limit);
  write.value = 2.0f;
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok);
  CHECK(rig.fixed().gains[0].limit == limit / 2);
  write.value = 13.0f;  // more than the supply has
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok);
  CHECK(rig.wrong_item() == write.item && rig.fixed().gains[0].limit == limit / 2);
  CHECK(ask(ConfigDefaults::kCode) == Result::ok && rig.fixed().gains[0].limit == limit);
  CHECK(rig.may_configure());
  rig.trip(Fault::speed_1);  // not in a fault, unless it is that of the settings
  CHECK(!rig.may_configure() && ask(ConfigWrite::kCode, &write) == Result::wrong_state);
  fresh_rig();
  rig.begin(nullptr, 1, kFirmware);
  CHECK(rig.may_configure());
}

static void arming_begins_everything_anew() {
  // The silence of the host before does not count: 200 ticks are allowed.
  arm(Mode::position);
  tick(150);
  CHECK(ask(Stop::kCode) == Result::ok && arm_as(Mode::position) == Result::ok);
  tick(150);
  CHECK(rig.state() == State::armed);
  // Joint 2 starts from the pulses that were told.
  Config config = default_config();
  config.position_max_2_rad() = 2;
  begin_with(config);
  CHECK(reference(0, 300, 400) == Result::ok && arm_as(Mode::position) == Result::ok);
  Setpoints points = {};
  points.count = 1;
  points.final = 1;
  points.position_2[0] = 400L * 256;
  const Start start = {0};
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  // The velocity of a run before does not: with a derivative gain it would drive the motor.
  config = default_config();
  config.lost_step_rad() = 10;
  config.kp_1_V_m() = 0;
  config.kd_1_V_s_m() = 100;
  config.speed_max_1_m_s() = 10;
  begin_with(config);
  CHECK(reference(0, 0, 0) == Result::ok && arm_as(Mode::position) == Result::ok);
  for (uint8_t k = 0; k < 30; ++k) {
    still().moved[0] = 5;
    rig.inputs().edges[0][0] = rig.inputs().edges[0][1] = 3;
    rig.tick(out);
  }
  CHECK(ask(Stop::kCode) == Result::ok && arm_as(Mode::position) == Result::ok);
  points = Setpoints();
  points.count = 1;
  points.final = 1;
  points.position_1[0] = 150L * 256;
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  still();
  rig.prepare();
  rig.tick(out);
  CHECK(rig.state() == State::running && out.duty[0] == 0);
}

static void tests() {
  RUN(a_report_has_all_that_the_tick_knew);
  RUN(without_a_drive_a_report_has_no_voltage);
  RUN(a_report_has_the_voltage_that_was_asked_for);
  RUN(joint_2_brakes_after_a_halt_and_stands_after_a_stop);
  RUN(a_refusal_says_the_state_and_stop_forgets_the_trajectory);
  RUN(a_reference_agrees_with_itself_to_the_count);
  RUN(steps_are_lost_to_the_fraction);
  RUN(the_stop_is_open_for_fifty_ticks);
  RUN(what_a_run_left_does_not_reach_the_next);
  RUN(armed_is_at_rest);
  RUN(the_rate_of_joint_2_is_that_of_its_pulses);
  RUN(refusals_carry_their_number);
  RUN(set_points_to_the_end_and_no_further);
  RUN(drives_end_with_the_final_one_and_begin_anew);
  RUN(settings_are_in_use_at_once_or_not_at_all);
  RUN(arming_begins_everything_anew);
}
CHECK_MAIN(tests())
