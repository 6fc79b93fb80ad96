// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the rig may do when, each fault and its reason, and all of the control in one.
#include <math.h>

#include "bench.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static void states_follow_each_other_and_nothing_else() {
  arm(Mode::position);
  const Start start = {3};
  const Arm again = {2};
  CHECK(ask(Start::kCode, &start) == Result::not_ready);
  CHECK(ask(Arm::kCode, &again) == Result::wrong_state && ask(Halt::kCode) == Result::wrong_state);
  tick();
  CHECK(out.on && out.duty[0] == 0);
  Setpoints points = {};
  points.count = 2;
  points.final = 1;
  points.first = 1;
  CHECK(ask(Setpoints::kCode, &points) == Result::wrong_index);
  points.first = 0;
  points.position_1[1] = 2000000000L;
  CHECK(ask(Setpoints::kCode, &points) == Result::out_of_range);
  points.position_1[1] = 400L * 256;
  CHECK(ask(Setpoints::kCode, &points) == Result::ok);
  CHECK(ask(Start::kCode, &start) == Result::ok);
  tick(20);
  CHECK(out.duty[0] > 0);  // 5 mm x 200 V/m = 1 V
  CHECK(ask(Halt::kCode) == Result::ok && rig.state() == State::armed);
  tick();
  CHECK(out.on && out.duty[0] == 0);
  CHECK(ask(Stop::kCode) == Result::ok && rig.state() == State::idle);
  tick();
  CHECK(!out.on);
}

static void the_first_fault_is_kept_until_cleared_by_name() {
  run_open_loop(1000, 0);
  tick(5);
  CHECK(out.on && out.duty[0] > 0);
  rig.inputs().switches = 1 << static_cast<uint8_t>(Flag::limit_high);
  tick();
  CHECK(!out.on && out.duty[0] == 0 && rig.fault() == Fault::limit_high);
  rig.inputs().switches |= 1 << static_cast<uint8_t>(Flag::emergency_stop);
  tick();
  rig.trip(Fault::overrun);
  CHECK(rig.fault() == Fault::limit_high && ask(Stop::kCode) == Result::ok &&
        rig.state() == State::fault);
  Clear clear = {static_cast<uint8_t>(Fault::limit_high)};
  CHECK(ask(Clear::kCode, &clear) == Result::fault_persists);
  rig.inputs().switches = 0;
  tick();
  Clear other = {static_cast<uint8_t>(Fault::emergency_stop)};
  CHECK(ask(Clear::kCode, &other) == Result::fault_persists);
  CHECK(ask(Clear::kCode, &clear) == Result::ok && rig.state() == State::idle);
}

static Fault fault_when(void (*wrong)(uint16_t), int16_t mV, int16_t rate, uint16_t most) {
  run_open_loop(mV, rate);
  for (uint16_t k = 0; k < most && rig.state() != State::fault; ++k) {
    if (k % 50 == 0) rig.host_spoke();
    Inputs &in = rig.inputs();
    in.moved[0] = in.moved[1] = 0;
    in.stepped = static_cast<int8_t>(out.steps.up ? out.steps.count : -out.steps.count);
    memset(in.edges, 0, sizeof in.edges);
    wrong(k);
    rig.prepare();
    rig.tick(out);
  }
  if (rig.state() == State::fault) CHECK(!out.on && out.duty[0] == 0);
  return rig.fault();
}

static void nothing(uint16_t) {}
static void backwards(uint16_t) {
  rig.inputs().moved[0] = -1;
  rig.inputs().edges[0][0] = rig.inputs().edges[0][1] = 1;
}
static void fast(uint16_t) {
  rig.inputs().moved[0] = 8;
  rig.inputs().edges[0][0] = rig.inputs().edges[0][1] = 4;
}
static void one_line(uint16_t k) {
  rig.inputs().moved[0] = k & 1 ? 1 : -1;
  rig.inputs().edges[0][0] = 1;
}
static void misses(uint16_t) { rig.inputs().missed[1] = 1; }
static void flood(uint16_t k) { rig.inputs().flooded[1] = k == 3; }
static void flex_open(uint16_t) { rig.inputs().flex = 0; }
static void flex_shorted(uint16_t) { rig.inputs().flex = 1023 * kAdcSamples; }
static void no_supply(uint16_t) { rig.inputs().supply = 30; }
static void far_away(uint16_t k) {
  rig.inputs().moved[0] = k & 1 ? 4 : 3;
  rig.inputs().edges[0][0] = rig.inputs().edges[0][1] = 2;
}
static void reversed(uint16_t) {
  rig.inputs().moved[1] = static_cast<int8_t>(-rig.inputs().stepped);
}

static void every_fault_has_its_reason() {
  CHECK(fault_when(nothing, 3000, 0, 450) == Fault::stall_1);
  CHECK(fault_when(nothing, 1000, 0, 300) == Fault::none);
  CHECK(fault_when(nothing, 500, 0, 600) == Fault::underrun);  // eight knots of 64 ticks
  CHECK(fault_when(backwards, 3000, 0, 450) == Fault::runaway_1);
  CHECK(fault_when(fast, 3000, 0, 100) == Fault::speed_1);
  CHECK(fault_when(one_line, 3000, 0, 100) == Fault::encoder_1);
  CHECK(fault_when(misses, 1000, 0, 20) == Fault::encoder_2);
  CHECK(fault_when(flood, 1000, 0, 20) == Fault::encoder_2);
  CHECK(fault_when(flex_open, 1000, 0, 10) == Fault::flex_low);
  CHECK(fault_when(flex_shorted, 1000, 0, 10) == Fault::flex_high);
  CHECK(fault_when(no_supply, 1000, 0, 10) == Fault::supply_low);
  CHECK(fault_when(far_away, 1000, 0, 510) == Fault::travel_1);
}

static Fault fault_of_joint_2(void (*moves)(uint16_t)) {
  run_open_loop(0, 400);
  begin_with(default_config());  // 0.05 rad may be lost
  Inputs &in = rig.inputs();
  const Reference reference = {0, 0, 0};
  const Arm arm = {static_cast<uint8_t>(Mode::open_loop)};
  const Start start = {6};
  Drives drives = {};
  drives.count = 8;
  for (uint8_t k = 0; k < 8; ++k) drives.rate[k] = 400;
  CHECK(ask(Reference::kCode, &reference) == Result::ok && ask(Arm::kCode, &arm) == Result::ok);
  CHECK(ask(Drives::kCode, &drives) == Result::ok && ask(Start::kCode, &start) == Result::ok);
  out = Outputs();
  for (uint16_t k = 0; k < 150 && rig.state() != State::fault; ++k) {
    in.moved[1] = 0;
    in.stepped = static_cast<int8_t>(out.steps.up ? out.steps.count : -out.steps.count);
    memset(in.edges, 0, sizeof in.edges);
    moves(k);
    rig.prepare();
    rig.tick(out);
  }
  return rig.fault();
}

static void follows(uint16_t) {
  static int8_t owed;
  owed = static_cast<int8_t>(owed + 3 * rig.inputs().stepped);  // 3 counts for 4 microsteps
  for (rig.inputs().moved[1] = 0; owed >= 4; owed = static_cast<int8_t>(owed - 4))
    ++rig.inputs().moved[1];
}
static void trembles(uint16_t k) {
  rig.inputs().moved[1] = static_cast<int8_t>(k % 4 == 0 ? 1 : k % 4 == 2 ? -1 : 0);
  rig.inputs().edges[1][0] = k % 2 == 0;
}

static void joint_2_is_watched_by_its_encoder() {
  CHECK(fault_of_joint_2(follows) == Fault::none);
  CHECK(fault_of_joint_2(nothing) == Fault::stall_2);
  CHECK(fault_of_joint_2(reversed) == Fault::runaway_2);
  CHECK(fault_of_joint_2(trembles) == Fault::encoder_2);
}

// A shaft that rests on an edge of line A and crosses it again and again.
static bool trembles_without_a_fault(uint16_t ticks, int8_t (*stepped)(uint16_t)) {
  run_open_loop(0, 0);
  for (uint16_t k = 0; k < ticks && rig.state() != State::fault; ++k) {
    if (k % 50 == 0) rig.host_spoke();
    if (k % 256 == 0) {  // the host goes on with its knots
      Drives drives = {};
      drives.first = static_cast<uint16_t>(8 + k / 64);
      drives.count = 4;
      CHECK(ask(Drives::kCode, &drives) == Result::ok);
    }
    Inputs &in = rig.inputs();
    memset(in.edges, 0, sizeof in.edges);
    in.moved[0] = 0;
    trembles(k);
    in.stepped = stepped(k);
    rig.prepare();
    rig.tick(out);
  }
  return rig.state() == State::running;
}

static int8_t once(uint16_t k) { return k == 0; }
static int8_t to_and_fro(uint16_t k) { return k % 20 ? 0 : k % 40 ? -1 : 1; }
static int8_t onwards(uint16_t k) { return k % 20 == 0; }

static void a_shaft_that_trembles_is_no_broken_wire() {
  CHECK(trembles_without_a_fault(20000, once));
  CHECK(trembles_without_a_fault(20000, to_and_fro));
  CHECK(!trembles_without_a_fault(20000, onwards) && rig.fault() == Fault::encoder_2);
}

static void without_a_proven_stop_nothing_is_armed() {
  const Reference reference = {0, 0, 0};
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  const uint8_t open = 1 << static_cast<uint8_t>(Flag::emergency_stop);
  const uint32_t others[] = {0, kFirmware - 1, kFirmware ^ 0x80000000UL};
  for (uint32_t proven : others) {
    begin_with(default_config(), proven);
    Inputs &in = rig.inputs();
    uint16_t detail = 99;
    CHECK(ask(Reference::kCode, &reference) == Result::ok);
    CHECK(rig.command(Arm::kCode, reinterpret_cast<const uint8_t *>(&arm), detail) ==
              Result::stop_unproven &&
          detail == static_cast<uint16_t>(StopTrial::untried));
    CHECK(ask(Commission::kCode) == Result::stop_unproven);
    for (uint8_t n = 0; n < 10; ++n) {  // a disturbance is no press
      in.switches = open;
      tick(30);
      in.switches = 0;
      tick();
    }
    CHECK(rig.stop_trial() == StopTrial::untried);
    in.switches = open;
    tick(60);
    CHECK(ask(Commission::kCode) == Result::stop_unproven && rig.proven() == proven);
    in.switches = 0;
    tick();
    CHECK(ask(Arm::kCode, &arm) == Result::stop_unproven);  // seen, but nobody said so
    CHECK(ask(Commission::kCode) == Result::ok && rig.proven() == kFirmware);
    CHECK(ask(Arm::kCode, &arm) == Result::ok);
    CHECK(ask(Commission::kCode) == Result::wrong_state);
  }
}

static void a_position_lost_with_the_outputs_off_is_unknown() {
  const Reference reference = {0, 0, 0};
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  for (uint8_t k = 0; k < 4; ++k) {
    healthy();
    CHECK(ask(Reference::kCode, &reference) == Result::ok);
    Inputs &in = rig.inputs();
    if (k < 2) in.missed[k] = 1;
    if (k >= 2) in.flooded[k - 2] = true;
    tick();
    in.missed[0] = in.missed[1] = 0;
    in.flooded[0] = in.flooded[1] = false;
    tick();
    CHECK(ask(Arm::kCode, &arm) == Result::not_referenced);
    CHECK(ask(Reference::kCode, &reference) == Result::ok && ask(Arm::kCode, &arm) == Result::ok);
  }
}

static void a_silent_host_stops_all() {
  run_open_loop(1000, 0);
  tick(200);
  CHECK(rig.state() == State::running);
  tick(2);
  CHECK(rig.fault() == Fault::host_silent && !out.on);
}

static void a_configuration_must_make_sense() {
  FixedPointConfig fixed;
  Config config = default_config();
  CHECK(to_fixed_point(config, fixed) == kAllValid);
  const float *value = config.values;
  for (uint8_t item = 0; item < kConfigItems; ++item) {
    CHECK(in_range(item, value[item]) && !in_range(item, NAN) && !in_range(item, INFINITY) &&
          !in_range(item, -1e30f));
  }
  CHECK(!in_range(kConfigItems, 0));
  config.position_min_1_m() = config.position_max_1_m();
  CHECK(to_fixed_point(config, fixed) == ITEM(position_min_1_m));
  config = default_config();
  config.voltage_max_V() = 13;
  CHECK(to_fixed_point(config, fixed) == ITEM(voltage_max_V));
  fresh_rig();
  rig.begin(nullptr, 1, kFirmware);
  CHECK(rig.fault() == Fault::bad_configuration);
  const Clear clear = {static_cast<uint8_t>(Fault::bad_configuration)};
  CHECK(ask(Clear::kCode, &clear) == Result::fault_persists);
  const ConfigWrite write = {ITEM(voltage_max_V), 13.0f}, back = {ITEM(voltage_max_V), 5.0f};
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok && rig.wrong_item() == ITEM(voltage_max_V));
  CHECK(ask(ConfigWrite::kCode, &back) == Result::ok && rig.wrong_item() == kAllValid);
  rig.stored();
  CHECK(ask(Clear::kCode, &clear) == Result::ok);
}

static void resets_are_told() {
  const Config config = default_config();
  begin(config, 1 << static_cast<uint8_t>(Reset::watchdog));
  CHECK(rig.fault() == Fault::watchdog);
  begin(config, 1 << static_cast<uint8_t>(Reset::brown_out));
  CHECK(rig.fault() == Fault::brown_out);
  begin(config,
        1 << static_cast<uint8_t>(Reset::brown_out) | 1 << static_cast<uint8_t>(Reset::power_on));
  CHECK(rig.fault() == Fault::none);
}

// All of the control in one: what it puts out over 300 ticks, as a CRC that must be the same
// wherever this runs.
static uint32_t outputs_of_the_control(float observer_Hz) {
  healthy();
  Config config = default_config();
  config.position_max_1_m() = 1;
  config.position_max_2_rad() = 100;
  config.voltage_max_V() = 12;
  config.speed_max_1_m_s() = 1;
  config.speed_max_2_rad_s() = 20;
  config.following_max_1_m() = 1;
  config.following_max_2_rad() = 100;
  config.lost_step_rad() = 10;
  config.rate_max_2_rad_s() = 7.8f;
  config.acceleration_max_2_rad_s2() = 5000;
  config.runaway_distance_m() = 1;
  config.host_timeout_s() = 5;
  config.ki_1_V_m_s() = 100;
  config.kd_1_V_s_m() = 5;
  config.kf_1_V_m() = 30;
  config.kg_1_V_s_m() = 3;
  config.kv_1_V_s_m() = 20;
  config.kc_1_V() = 0.3f;
  config.ki_2_1_s2() = 2;
  config.kd_2() = 0.02f;
  config.kf_2_rad_s_m() = 2;
  config.kg_2_rad_m() = 0.2f;
  config.feedback_2() = 1;
  config.setpoint_1_Hz() = config.setpoint_2_Hz() = 100;
  config.observer_1_Hz() = observer_Hz;
  config.jo_1_V_s2_m() = 1.2f;
  config.bo_1_V_s_m() = 15;
  config.flex_c1_m() = 0.3f;
  config.flex_c2_m() = config.flex_c3_m() = 0.1f;
  begin_with(config);
  Inputs &in = rig.inputs();
  const Reference reference = {0, 0, 0};
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  const Start start = {3};
  CHECK(ask(Reference::kCode, &reference) == Result::ok && ask(Arm::kCode, &arm) == Result::ok);
  for (uint8_t n = 0; n < 12; ++n) {
    Setpoints points = {};
    points.first = static_cast<uint16_t>(4 * n);
    points.count = 4;
    for (uint8_t k = 0; k < 4; ++k) {
      points.position_1[k] = (4L * n + k) * 2560 * 8;
      points.velocity_1[k] = 2560;
      points.position_2[k] = (4L * n + k) * 1024 * 8;
      points.velocity_2[k] = 1024;
    }
    CHECK(ask(Setpoints::kCode, &points) == Result::ok);
  }
  CHECK(ask(Start::kCode, &start) == Result::ok);
  uint32_t crc = 0;
  uint16_t pulses = 0;
  out = Outputs();
  for (uint16_t k = 0; k < 300; ++k) {
    in.moved[0] = static_cast<int8_t>(9 + (k & 1));
    in.moved[1] = 3;
    in.stepped = static_cast<int8_t>(out.steps.up ? out.steps.count : -out.steps.count);
    in.flex = static_cast<uint16_t>(3500 + (k * 37 & 127));
    in.edges[0][0] = in.edges[0][1] = in.edges[1][0] = in.edges[1][1] = 2;
    rig.prepare();
    rig.tick(out);
    pulses = static_cast<uint16_t>(pulses + out.steps.count);
    crc = crc32(reinterpret_cast<const uint8_t *>(&out.duty[0]), 2, crc);
    crc = crc32(&out.steps.count, 1, crc);
    crc = crc32(reinterpret_cast<const uint8_t *>(out.steps.at),
                static_cast<uint16_t>(2 * out.steps.count), crc);
  }
  CHECK(rig.state() == State::running && pulses > 1100);
  return crc;
}

static void host_and_board_compute_the_same() {
  // As g++ 12 for x86-64 and avr-gcc 5.4 and 7.3 compute it; a change of the control's arithmetic
  // changes it.
  CHECK(outputs_of_the_control(0) == 2640998764ul);
  CHECK(outputs_of_the_control(8) == 3066574599ul);
}

static void tests() {
  RUN(states_follow_each_other_and_nothing_else);
  RUN(the_first_fault_is_kept_until_cleared_by_name);
  RUN(every_fault_has_its_reason);
  RUN(joint_2_is_watched_by_its_encoder);
  RUN(a_shaft_that_trembles_is_no_broken_wire);
  RUN(without_a_proven_stop_nothing_is_armed);
  RUN(a_position_lost_with_the_outputs_off_is_unknown);
  RUN(a_silent_host_stops_all);
  RUN(a_configuration_must_make_sense);
  RUN(resets_are_told);
  RUN(host_and_board_compute_the_same);
}
CHECK_MAIN(tests())
