// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Rigs with other drives than a carriage and a stepper: motors that turn their joints, one joint
// alone, a stepper without an encoder.
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "check.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static void nothing(uint16_t) {}

// A rig whose joints are turned by motors, or which has but one joint.
static void turning(float drive_2, float encoder_2 = 1) {
  Config config = default_config();
  config.drive_1() = 2;
  config.drive_2() = drive_2;
  config.encoder_2() = encoder_2;
  begin_with(config);
  const Reference reference = {0, 0, 0};
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
}

static Fault fault_of_motor_2(void (*moves)(uint16_t), int16_t mV, uint16_t most = 450) {
  turning(2);
  const Arm arm = {static_cast<uint8_t>(Mode::open_loop)};
  const Start start = {6};
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) drives.voltage_2[k] = mV / 2;
  CHECK(ask(Arm::kCode, &arm) == Result::ok && ask(Drives::kCode, &drives) == Result::ok);
  CHECK(ask(Start::kCode, &start) == Result::ok);
  Inputs &in = rig.inputs();
  for (uint16_t k = 0; k < most && rig.state() != State::fault; ++k) {
    if (k % 50 == 0) rig.host_spoke();
    in.moved[0] = in.moved[1] = 0;
    memset(in.edges, 0, sizeof in.edges);
    moves(k);
    rig.prepare();
    rig.tick(out);
    CHECK(out.duty[0] == 0 && out.steps.count == 0);
    if (k == 30 && mV) CHECK((out.duty[1] > 0) == (mV > 0));
  }
  return rig.fault();
}

static void turns(uint16_t k) {  // 0.5 rad/s at 100 counts/rad, forth and back
  if (k % 20 == 0) {
    rig.inputs().moved[1] = 1;
    rig.inputs().edges[1][k % 40 == 0] = 1;
  }
}
static void turns_back(uint16_t k) {
  if (k % 20 == 0) {
    rig.inputs().moved[1] = -1;
    rig.inputs().edges[1][k % 40 == 0] = 1;
  }
}
static void turns_fast(uint16_t) {
  rig.inputs().moved[1] = 8;
  rig.inputs().edges[1][0] = rig.inputs().edges[1][1] = 4;
}
static void one_line_of_2(uint16_t k) {
  rig.inputs().moved[1] = k & 1 ? 1 : -1;
  rig.inputs().edges[1][0] = 1;
}
static void misses_2(uint16_t) { rig.inputs().missed[1] = 1; }

static void a_motor_at_joint_2_is_watched_as_one_at_joint_1() {
  CHECK(fault_of_motor_2(nothing, 3000) == Fault::stall_2);
  CHECK(fault_of_motor_2(nothing, 1000, 300) == Fault::none);
  CHECK(fault_of_motor_2(turns, 3000, 300) == Fault::none);
  CHECK(fault_of_motor_2(turns, 3000) == Fault::travel_2);  // 0.2 rad
  CHECK(fault_of_motor_2(turns_back, 3000) == Fault::runaway_2);
  CHECK(fault_of_motor_2(turns_back, -3000, 300) == Fault::none);
  CHECK(fault_of_motor_2(turns_fast, 3000) == Fault::speed_2);
  CHECK(fault_of_motor_2(one_line_of_2, 3000) == Fault::encoder_2);
  CHECK(fault_of_motor_2(misses_2, 1000) == Fault::encoder_2);
}

static void both_motors_hold_their_set_points() {
  turning(2);
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  CHECK(ask(Arm::kCode, &arm) == Result::ok);
  tick();
  CHECK(rig.state() == State::armed && out.duty[0] == 0 && out.duty[1] == 0);
  Setpoints points = {};
  points.count = 2;
  points.final = 1;
  for (uint8_t k = 0; k < 2; ++k) {  // off by less than a following error
    points.position_1[k] = 5 * 256;
    points.position_2[k] = -5 * 256;
  }
  const Start start = {3};
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  tick(20);
  // 5 V/rad x 0.05 rad of 12 V: 16.7 PWM counts of 800
  CHECK(rig.state() == State::running && out.duty[0] == 17 && out.duty[1] == -17);
  Telemetry report;
  rig.report(report);
  CHECK(abs(report.voltage - 125) <= 1 && abs(report.voltage_2 + 125) <= 1);  // 0.25 V
  CHECK(report.rate == 0);
  CHECK(!(report.flags >> static_cast<uint8_t>(Flag::driver_enabled) & 1));
}

// Two motors whose gain is just less than 8 units of output a count: at one count 7, which is no
// PWM count, and 8 with the least addition, which is one. Their observers take every output as a
// load.
static void motors_with_observers() {
  Config config = default_config();
  config.drive_1() = config.drive_2() = 2;
  config.kp_1_V_rad() = config.kp_2_V_rad() = 524287 / 65536.0f * 0.09375f;
  config.observer_1_Hz() = config.observer_2_Hz() = 20;
  begin_with(config);
  const FixedPointConfig &fixed = rig.fixed();
  CHECK(fixed.gains[0].kp == 524287 && fixed.gains[1].kp == 524287);
  CHECK(fixed.observer[0].filter && fixed.observer[1].filter);
  const Reference reference = {0, 0, 0};
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
}

static void run_to(int32_t counts, uint16_t armed_ticks = 0) {
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  Setpoints points = {};
  points.count = points.final = 1;
  points.position_1[0] = points.position_2[0] = counts * 256;
  const Start start = {3};
  CHECK(ask(Arm::kCode, &arm) == Result::ok);
  tick(armed_ticks);
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
}

static void what_observers_found_does_not_reach_the_next_run() {
  for (uint8_t odd = 0; odd < 2; ++odd) {  // the joints take turns
    motors_with_observers();
    run_to(5);
    tick(static_cast<uint16_t>(60 + odd));
    // 40 units without an observer, which are 2 PWM counts
    CHECK(out.duty[0] > 10 && out.duty[1] > 10 && ask(Stop::kCode) == Result::ok);
    run_to(1);
    tick();
    CHECK(out.on && out.duty[0] == 0 && out.duty[1] == 0);
  }
}

// Output 215 / 16 of a PWM count in the first tick, from nothing: one unit more would be 14 counts.
static void both_motors_start_from_nothing() {
  Config config = default_config();
  config.drive_1() = config.drive_2() = 2;
  config.kp_1_V_rad() = config.kp_2_V_rad() = 10;
  config.voltage_slew_V_s() = 201.5f;
  begin_with(config);
  const Reference reference = {0, 0, 0};
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
  CHECK(rig.fixed().gains[1].slew == 215);
  run_to(9, 3);
  tick();
  CHECK(out.duty[0] == (215 + 8) / 16 && out.duty[1] == (215 + 8) / 16);
}

static void a_rig_of_one_joint_moves_and_hears_nothing_of_a_second() {
  turning(0);
  const Reference elsewhere = {0, 3, 0}, pulses = {0, 0, 5};
  CHECK(ask(Reference::kCode, &elsewhere) == Result::out_of_range);
  CHECK(ask(Reference::kCode, &pulses) == Result::out_of_range);
  Arm arm = {static_cast<uint8_t>(Mode::open_loop)};
  CHECK(ask(Arm::kCode, &arm) == Result::ok);
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) {
    drives.rate[k] = 1;
    CHECK(ask(Drives::kCode, &drives) == Result::out_of_range);
    drives.rate[k] = 0;
    drives.voltage_2[k] = 1;
    CHECK(ask(Drives::kCode, &drives) == Result::out_of_range);
    drives.voltage_2[k] = 0;
  }
  CHECK(ask(Stop::kCode) == Result::ok);
  arm.mode = static_cast<uint8_t>(Mode::position);
  CHECK(ask(Arm::kCode, &arm) == Result::ok);
  Setpoints points = {};
  points.count = 2;
  points.final = 1;
  points.position_2[1] = 1;
  CHECK(ask(Setpoints::kCode, &points) == Result::out_of_range);
  points.position_2[1] = 0;
  points.position_1[0] = points.position_1[1] = 5 * 256;
  const Start start = {3};
  CHECK(ask(Setpoints::kCode, &points) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  Inputs &in = rig.inputs();
  in.missed[1] = 9;  // its wires hang in the air
  in.flooded[1] = true;
  in.moved[1] = 7;
  rig.prepare();
  rig.tick(out);
  tick(20);
  CHECK(rig.state() == State::running && out.duty[0] > 0 && out.duty[1] == 0);
  CHECK(out.steps.count == 0);
  Telemetry report;
  rig.report(report);
  CHECK(report.position_2 == 0 && report.missed == 0);
}

static void a_stepper_without_an_encoder_is_where_its_pulses_are() {
  Config config = default_config();
  config.encoder_2() = 0;
  config.feedback_2() = 1;
  begin_with(config);
  Inputs &in = rig.inputs();
  const Reference reference = {0, 12, 12}, apart = {0, 500, 0};
  CHECK(ask(Reference::kCode, &apart) == Result::out_of_range);
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
  const Arm arm = {static_cast<uint8_t>(Mode::open_loop)};
  CHECK(ask(Arm::kCode, &arm) == Result::ok);
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) drives.rate[k] = 400;
  const Start start = {6};
  CHECK(ask(Drives::kCode, &drives) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  for (uint16_t k = 0; k < 150; ++k) {
    in.moved[1] = 5;  // an open line catches noise
    in.missed[1] = 1;
    in.edges[1][0] = 5;
    in.flooded[1] = true;
    in.stepped = static_cast<int8_t>(out.steps.up ? out.steps.count : -out.steps.count);
    rig.prepare();
    rig.tick(out);
  }
  CHECK(rig.state() == State::running);
  Telemetry report;
  rig.report(report);
  CHECK(report.steps > 30 && report.position_2 == report.steps);
}

static void a_motor_needs_its_pins_and_its_encoder() {
  Config config = default_config();
  FixedPointConfig fixed;
  config.drive_2() = 2;
  CHECK(to_fixed_point(config, fixed) == kAllValid);
  config.encoder_2() = 0;
  CHECK(to_fixed_point(config, fixed) == ITEM(encoder_2));
  config.encoder_2() = 1;
  const Stored stored = {config, kFirmware};
  fresh_rig();
  rig.begin(&stored, 1, kFirmware, 1);
  CHECK(rig.fault() == Fault::bad_configuration && rig.drive(1) == Drive::stepper);
  const ConfigWrite write = {ITEM(drive_2), 2.0f};
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok && rig.wrong_item() == ITEM(drive_2));
}

static Result written(Item item, float value) {
  const ConfigWrite write = {static_cast<uint8_t>(item), value};
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok && rig.wrong_item() == kAllValid);
  const Arm arm = {static_cast<uint8_t>(Mode::open_loop)};
  const Result armed = ask(Arm::kCode, &arm);
  if (armed == Result::ok) CHECK(ask(Stop::kCode) == Result::ok);
  const Reference reference = {0, 0, 0};
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
  return armed;
}

static void another_drive_or_encoder_asks_for_a_reference_anew() {
  turning(1);
  CHECK(written(Item::kp_1_V_rad, 6.0f) == Result::ok);
  CHECK(written(Item::drive_2, 0.0f) == Result::not_referenced);
  CHECK(written(Item::drive_2, 1.0f) == Result::not_referenced);
  CHECK(written(Item::encoder_2, 0.0f) == Result::not_referenced);
  CHECK(written(Item::kp_1_V_rad, 5.0f) == Result::ok);
}

static void tests() {
  RUN(a_motor_at_joint_2_is_watched_as_one_at_joint_1);
  RUN(both_motors_hold_their_set_points);
  RUN(what_observers_found_does_not_reach_the_next_run);
  RUN(both_motors_start_from_nothing);
  RUN(a_rig_of_one_joint_moves_and_hears_nothing_of_a_second);
  RUN(a_stepper_without_an_encoder_is_where_its_pulses_are);
  RUN(a_motor_needs_its_pins_and_its_encoder);
  RUN(another_drive_or_encoder_asks_for_a_reference_anew);
}
CHECK_MAIN(tests())
