// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the board refuses, and what it does when an interrupt comes between two lines: the branches
// that a good host never takes.
#include "bench.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

// ---- numeric

static void sums_at_the_ends_of_32_bits_stay_there() {
  CHECK(add(kInt32Max, 1) == kInt32Max && add(kInt32Min, -1) == kInt32Min && add(-5, 7) == 2);
  CHECK(subtract(kInt32Max, -1) == kInt32Max && subtract(kInt32Min, 1) == kInt32Min);
  CHECK(subtract(-5, 7) == -12 && subtract(0, kInt32Min) == kInt32Max);
}

static void a_sum_of_errors_stops_at_both_limits() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    PidGains gains;
    gains.limit = 1000;
    gains.slew = 1000;
    gains.ki = 1L << 20;
    Pid pid;
    pid.start(0);
    const PidSignals far = {static_cast<int32_t>(sign * 32767L * 256), 0, 0, 0}, at = {0, 0, 0, 0};
    for (uint16_t k = 0; k < 2000; ++k) pid.update(gains, far);
    const int16_t held = pid.update(gains, at);
    // One error more would pass the limit; none was added beyond it.
    CHECK(held * sign > 980 && held * sign <= 1000);
  }
}

static void the_least_gains_and_rates_count() {
  const PidGains none;
  CHECK(!none.fine && none.kp == 0 && none.ki == 0 && none.kd == 0 && none.kf == 0);
  CHECK(none.kg == 0 && none.kv == 0 && none.kc == 0 && none.limit == 0 && none.slew == 0);
  PidGains gains;
  gains.limit = 1000;
  gains.slew = 1000;
  Pid fresh;
  CHECK(fresh.output() == 0);
  gains.kp = 65536;
  gains.fine = true;  // 1/16 counts
  const PidSignals five = {5 * 16, 0, 0, 0};
  CHECK(fresh.update(gains, five) == 5);
  gains.fine = false;  // whole counts
  const PidSignals seven = {7 * 256 + 255, 0, 0, 0};
  CHECK(fresh.update(gains, seven) == 7);
  gains.kp = 0;
  // Sums are in 2^-16 of u: what kd = 1 makes of a rate of 25600 is the rest to 1.
  gains.kd = 1;
  PidSignals in = {0, -25600, 0, 65536L - 25600};
  CHECK(fresh.update(gains, in) == 1);
  gains.kd = 0;
  gains.kc = 70;
  for (int16_t rate = -2; rate <= 2; ++rate) {
    in = {0, 0, rate, 0};
    CHECK(fresh.update(gains, in) == (rate > 0 ? 70 : rate < 0 ? -70 : 0));
  }
  // ki = 1 is 2^-32: the last of 2^32 makes a unit of u.
  gains.kc = 0;
  gains.ki = 1114129L;  // times 3855 it is 2^32 - 1
  in = {3855L * 256, 0, 0, 0};
  CHECK(fresh.update(gains, in) == 0);
  gains.ki = 1;
  in = {256, 0, 0, 0};
  CHECK(fresh.update(gains, in) == 1);
}

// ---- settings

struct Setting {
  Item item;
  float value;
};

// The item that is refused when these two differ from the defaults, whose gains of joint 1 are 0.
static uint8_t wrong_with(Setting one, Setting other) {
  Config config = default_config();
  FixedPointConfig fixed;
  config.kp_1_V_m() = 0;  // at few counts a metre it would be the first that does not fit
  config.values[static_cast<uint8_t>(one.item)] = one.value;
  config.values[static_cast<uint8_t>(other.item)] = other.value;
  return to_fixed_point(config, fixed);
}

static void settings_that_do_not_fit_the_boards_numbers_are_named() {
#define WRONG(name, value, other, its) \
  CHECK(wrong_with({Item::name, value}, {Item::other, its}) == static_cast<uint8_t>(Item::name))
  const Setting fine = {Item::voltage_max_V, 1.0f};
  CHECK(wrong_with(fine, fine) == kAllValid);
  WRONG(kp_1_V_m, 1e5f, motor_counts_per_m, 100.0f);
  WRONG(kp_1_V_m, -1e5f, motor_counts_per_m, 100.0f);
  WRONG(ki_1_V_m_s, 1e6f, motor_counts_per_m, 100.0f);
  WRONG(kd_1_V_s_m, 1e4f, motor_counts_per_m, 100.0f);
  WRONG(kf_1_V_m, 1e5f, supply_V, 12.0f);
  WRONG(kf_1_V_m, -1e5f, supply_V, 12.0f);
  WRONG(kg_1_V_s_m, 1e4f, supply_V, 12.0f);
  WRONG(kv_1_V_s_m, -1e4f, motor_counts_per_m, 100.0f);
  WRONG(kc_1_V, 13.0f, supply_V, 12.0f);
  WRONG(voltage_max_V, 13.0f, supply_V, 12.0f);
  WRONG(ki_2_1_s2, 1e4f, supply_V, 12.0f);
  WRONG(kd_2, 10.0f, supply_V, 12.0f);
  WRONG(kf_2_rad_s_m, 1e4f, supply_V, 12.0f);
  WRONG(kg_2_rad_m, 1e3f, stepper_steps_per_rad, 3000.0f);
  WRONG(rate_max_2_rad_s, 8.0f, supply_V, 12.0f);
  WRONG(position_min_1_m, 0.02f, position_max_1_m, 0.02f);
  WRONG(position_min_2_rad, 0.3f, position_max_2_rad, 0.2f);
  WRONG(position_min_1_m, -10.0f, motor_counts_per_m, 1e6f);
  WRONG(position_max_1_m, 10.0f, motor_counts_per_m, 1e6f);
  CHECK(wrong_with({Item::stepper_steps_per_rad, 8e4f}, {Item::position_min_2_rad, -1e3f}) ==
        static_cast<uint8_t>(Item::rate_max_2_rad_s));
  WRONG(flex_min, 0.95f, flex_max, 0.95f);
  WRONG(supply_min_V, 14.0f, supply_max_V, 14.0f);
  WRONG(stepper_counts_per_rad, 1.0f, stepper_steps_per_rad, 3999.0f);
  WRONG(observer_2_Hz, 5.0f, supply_V, 12.0f);  // joint 2 has a stepper
#undef WRONG
  Config observed = default_config();
  FixedPointConfig made;
  observed.kp_1_V_m() = 1.0f;
  observed.motor_counts_per_m() = 100.0f;
  observed.observer_1_Hz() = 100.0f;
  observed.jo_1_V_s2_m() = 1000.0f;
  CHECK(to_fixed_point(observed, made) == static_cast<uint8_t>(Item::jo_1_V_s2_m));
  observed.jo_1_V_s2_m() = 0.0f;
  observed.bo_1_V_s_m() = 1e4f;
  CHECK(to_fixed_point(observed, made) == static_cast<uint8_t>(Item::bo_1_V_s_m));
  // Of joint 2 with so many microsteps that its rate must be small too.
  Config config = default_config();
  FixedPointConfig fixed;
  config.stepper_steps_per_rad() = 1e5f;
  config.rate_max_2_rad_s() = 0.04f;
  config.position_min_2_rad() = -1e3f;
  CHECK(to_fixed_point(config, fixed) == static_cast<uint8_t>(Item::position_min_2_rad));
  config.position_min_2_rad() = -1.0f;
  config.position_max_2_rad() = 1e3f;
  CHECK(to_fixed_point(config, fixed) == static_cast<uint8_t>(Item::position_max_2_rad));
  config.position_max_2_rad() = 1.0f;
  config.following_max_2_rad() = 1e3f;
  CHECK(to_fixed_point(config, fixed) == static_cast<uint8_t>(Item::following_max_2_rad));
  config.following_max_2_rad() = 1.0f;
  config.stepper_counts_per_rad() = 1.0f;  // the ratio does not fit 32 bits
  CHECK(to_fixed_point(config, fixed) == static_cast<uint8_t>(Item::stepper_counts_per_rad));
  config = default_config();
  config.motor_counts_per_m() = 1e6f;
  config.following_max_1_m() = 10.0f;
  CHECK(to_fixed_point(config, fixed) == static_cast<uint8_t>(Item::following_max_1_m));
}

static void stored_settings_that_are_wrong_are_not_used() {
  Config config = default_config();
  config.supply_V() = 61.0f;  // beyond its range
  begin(config);
  CHECK(rig.state() == State::fault && rig.fault() == Fault::bad_configuration);
  CHECK(rig.config().supply_V() == default_config().supply_V() && rig.wrong_item() == kAllValid);
  config.supply_V() = 12.0f;
  config.flex_min() = 0.96f;  // more than flex_max
  begin(config);
  CHECK(rig.fault() == Fault::bad_configuration);
  fresh_rig();
  rig.begin(nullptr, 1, kFirmware);
  CHECK(rig.fault() == Fault::bad_configuration && rig.proven() == 0);
}

// ---- commands

static Result ask(uint8_t code, const void *fields, uint16_t &detail) {
  return rig.command(code, static_cast<const uint8_t *>(fields), detail);
}

static Result reference(int32_t position_1 = 0) {
  const Reference here = {position_1, 0, 0};
  return ask(Reference::kCode, &here);
}

static Result arm_as(uint8_t mode, uint16_t &detail) {
  const Arm arm = {mode};
  return ask(Arm::kCode, &arm, detail);
}

static Result start(uint8_t period_log2 = 3) {
  const Start start = {period_log2};
  return ask(Start::kCode, &start);
}

static Setpoints points(uint8_t count, bool final, uint16_t first = 0) {
  Setpoints out = {};
  out.first = first;
  out.count = count;
  out.final = final;
  return out;
}

static void arming_asks_for_settings_firmware_mode_and_inputs() {
  uint16_t detail;
  healthy();
  CHECK(ask(99) == Result::unknown_command);
  CHECK(reference() == Result::ok);
  CHECK(arm_as(0, detail) == Result::out_of_range && arm_as(3, detail) == Result::out_of_range);
  ConfigWrite write = {static_cast<uint8_t>(Item::flex_min), 0.96f};
  CHECK(ask(ConfigWrite::kCode, &write) == Result::ok);  // contradicts flex_max
  CHECK(arm_as(2, detail) == Result::inconsistent && detail == write.item);
  CHECK(ask(ConfigDefaults::kCode) == Result::ok && arm_as(2, detail) == Result::ok);
  CHECK(ask(ConfigDefaults::kCode) == Result::wrong_state);
  CHECK(ask(ConfigWrite::kCode, &write) == Result::wrong_state);
  CHECK(ask(Commission::kCode) == Result::wrong_state && reference() == Result::wrong_state);

  // A firmware without a hash proves nothing, even if the memory has the same.
  fresh_rig();
  const Stored stored = {default_config(), 0};
  rig.begin(&stored, 1, 0);
  CHECK(reference() == Result::ok && arm_as(2, detail) == Result::stop_unproven);

  static const struct {
    uint16_t flex, supply;
    uint8_t switches;
    Fault fault;
  } kWrong[] = {{0, 500, 0, Fault::flex_low},     {4092, 500, 0, Fault::flex_high},
                {3500, 30, 0, Fault::supply_low}, {3500, 1000, 0, Fault::supply_high},
                {3500, 500, 1, Fault::none},      {3500, 500, 2, Fault::none}};
  for (const auto &wrong : kWrong) {
    healthy();
    CHECK(reference() == Result::ok);
    Inputs &in = rig.inputs();
    in.flex = wrong.flex;
    in.supply = wrong.supply;
    in.switches = wrong.switches;
    CHECK(arm_as(2, detail) == Result::fault_persists && rig.state() == State::idle);
    CHECK(wrong.fault == Fault::none || detail == static_cast<uint16_t>(wrong.fault));
  }
}

static void positions_that_32_bits_do_not_hold_are_refused() {
  healthy();
  const int32_t far = 1L << 22;
  static const Reference kFar[] = {{far, 0, 0},  {-far, 0, 0}, {0, far, 0},
                                   {0, -far, 0}, {0, 0, far},  {0, 0, -far}};
  for (const Reference &where : kFar) CHECK(ask(Reference::kCode, &where) == Result::out_of_range);
  CHECK(reference(far - 1) == Result::ok);
  // The pulses must agree with the encoder of joint 2, whose tolerance is 10 rad here.
  const Reference more = {0, 0, 6000}, less = {0, 0, -6000};
  CHECK(ask(Reference::kCode, &more) == Result::out_of_range);
  CHECK(ask(Reference::kCode, &less) == Result::out_of_range);
}

static void set_points_that_jump_or_are_too_many_are_refused() {
  uint16_t detail;
  arm(Mode::position);
  Setpoints some = points(5, false);
  CHECK(ask(Setpoints::kCode, &some) == Result::out_of_range);
  some = points(0, false);
  CHECK(ask(Setpoints::kCode, &some) == Result::out_of_range);
  Drives drives = {};
  drives.count = 1;
  CHECK(ask(Drives::kCode, &drives) == Result::wrong_state);
  for (uint16_t k = 0; k < 60; k = static_cast<uint16_t>(k + 4)) {
    some = points(4, false, k);
    CHECK(ask(Setpoints::kCode, &some) == Result::ok);
  }
  some = points(4, false, 60);
  CHECK(ask(Setpoints::kCode, &some, detail) == Result::buffer_full && detail == 3);
  some = points(3, true, 60);
  CHECK(ask(Setpoints::kCode, &some) == Result::ok);
  some = points(1, false, 63);
  CHECK(ask(Setpoints::kCode, &some) == Result::wrong_state);  // after the final one

  // Wide ranges, so that it is the jump that is refused, in both directions and of both joints.
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.position_min_1_m() = -10;
  config.position_max_1_m() = 10;
  config.position_min_2_rad() = -1000;
  config.position_max_2_rad() = 1000;
  begin(config);
  rig.inputs().flex = 3500;
  rig.inputs().supply = 500;
  tick();
  CHECK(reference() == Result::ok && arm_as(2, detail) == Result::ok);
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    some = points(2, false);
    some.position_1[1] = sign * (kJump + 1);
    CHECK(ask(Setpoints::kCode, &some) == Result::out_of_range);
    some.position_1[1] = 0;
    some.position_2[1] = sign * (kJump + 1);
    CHECK(ask(Setpoints::kCode, &some) == Result::out_of_range);
  }
  some = points(2, false);
  some.position_1[1] = kJump;
  some.position_2[1] = -kJump;
  CHECK(ask(Setpoints::kCode, &some) == Result::ok);

  arm(Mode::open_loop);
  some = points(2, false);
  CHECK(ask(Setpoints::kCode, &some) == Result::wrong_state);
  CHECK(start(0) == Result::not_ready);
}

static void a_run_starts_where_the_joints_are() {
  uint16_t detail;
  for (uint8_t joint = 0; joint < 2; ++joint)
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      arm(Mode::position);
      Setpoints some = points(2, true);
      (joint ? some.position_2 : some.position_1)[0] = sign * (joint ? 90L : 1500L) * 256;
      (joint ? some.position_2 : some.position_1)[1] = sign * (joint ? 90L : 1500L) * 256;
      CHECK(ask(Setpoints::kCode, &some) == Result::ok && start(7) == Result::out_of_range);
      const Start begin = {3};
      CHECK(ask(Start::kCode, &begin, detail) == Result::out_of_range && detail == joint + 1u);
      CHECK(rig.state() == State::armed);
    }
  // One set-point that is the final one is a trajectory too: it is held. One that is not is none.
  arm(Mode::position);
  Setpoints one = points(1, false);
  CHECK(ask(Setpoints::kCode, &one) == Result::ok && start() == Result::not_ready);
  arm(Mode::position);
  one = points(1, true);
  CHECK(ask(Setpoints::kCode, &one) == Result::ok && start() == Result::ok);
  Telemetry report;
  tick(5);
  rig.report(report);
  CHECK(report.flags >> static_cast<uint8_t>(Flag::final) & 1 && rig.fault() == Fault::none);
  rig.trip(Fault::overrun);
  rig.report(report);
  CHECK(!(report.flags >> static_cast<uint8_t>(Flag::final) & 1));
}

static void at_its_limit_the_motor_is_said_to_be_there() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    run_open_loop(static_cast<int16_t>(sign * 12000), 0);  // 4 V are allowed
    Telemetry report;
    for (uint8_t k = 0; k < 40; ++k) {
      tick();
      rig.report(report);
      CHECK(!(report.flags >> static_cast<uint8_t>(Flag::final) & 1));
    }
    CHECK(report.flags >> static_cast<uint8_t>(Flag::saturated) & 1);
    CHECK(report.voltage * sign > 1950 && report.voltage * sign <= 2000);
  }
}

static void what_loses_the_position_asks_for_a_reference() {
  static const Fault kLost[] = {Fault::encoder_1, Fault::encoder_2, Fault::stall_2,
                                Fault::runaway_1, Fault::runaway_2};
  static const Fault kKept[] = {Fault::speed_1, Fault::stall_1, Fault::host_silent,
                                Fault::following_2};
  uint16_t detail;
  for (uint8_t k = 0; k < 9; ++k) {
    const Fault fault = k < 5 ? kLost[k] : kKept[k - 5];
    arm(Mode::position);
    rig.trip(fault);
    tick();
    const Clear clear = {static_cast<uint8_t>(fault)};
    CHECK(ask(Clear::kCode, &clear) == Result::ok && rig.state() == State::idle);
    CHECK(arm_as(2, detail) == (k < 5 ? Result::not_referenced : Result::ok));
    CHECK(ask(Clear::kCode, &clear) == Result::wrong_state);
  }
}

static void a_reading_out_of_range_forbids_to_clear_its_own_fault_only() {
  static const struct {
    Fault fault;
    uint16_t flex, supply;
  } kReadings[] = {{Fault::flex_low, 0, 500},
                   {Fault::flex_high, 4092, 500},
                   {Fault::supply_low, 3500, 30},
                   {Fault::supply_high, 3500, 1000}};
  uint16_t detail;
  for (const auto &reading : kReadings)
    for (uint8_t own = 0; own < 2; ++own) {
      arm(Mode::position);
      const Fault fault = own ? reading.fault : Fault::speed_1;
      rig.trip(fault);
      rig.inputs().flex = reading.flex;
      rig.inputs().supply = reading.supply;
      const Clear clear = {static_cast<uint8_t>(fault)};
      CHECK(ask(Clear::kCode, &clear, detail) == (own ? Result::fault_persists : Result::ok));
      CHECK(!own || detail == static_cast<uint16_t>(fault));
    }
  fresh_rig();
  rig.begin(nullptr, 1, kFirmware);  // nothing stored
  rig.inputs().flex = 3500;
  rig.inputs().supply = 500;
  const Clear clear = {static_cast<uint8_t>(Fault::bad_configuration)};
  CHECK(ask(Clear::kCode, &clear) == Result::fault_persists);
  CHECK(ask(ConfigDefaults::kCode) == Result::ok);  // may be mended in this fault
  rig.stored();
  CHECK(ask(Clear::kCode, &clear) == Result::ok && rig.state() == State::idle);
}

// ---- interrupts between two lines

static void press() { rig.trip(Fault::emergency_stop); }
static bool is_stopped() {
  return rig.state() == State::fault && rig.fault() == Fault::emergency_stop;
}

// Asks for it again and again, each time with the fault one lock later, until it comes too late.
// Returns how many it tried. Whenever the fault came, it stands at the end.
static uint8_t with_a_fault_at_each_lock(void (*prepare)(), Result (*ask_for)(), State reached) {
  for (uint8_t at = 0;; ++at) {
    prepare();
    interrupt = press;
    locks_until = at;
    const Result result = ask_for();
    if (interrupt) {  // too late for this one
      interrupt = nullptr;
      CHECK(result == Result::ok && rig.state() == reached);
      return at;
    }
    CHECK(is_stopped());
    Outputs now;
    rig.tick(now);
    CHECK(!now.on && now.duty[0] == 0 && is_stopped());
    if (check_line || at > 20) return at;
  }
}

static void ready_to_arm() {
  healthy();
  CHECK(reference() == Result::ok);
}
static Result do_arm() {
  uint16_t detail;
  return arm_as(2, detail);
}
static void ready_to_start() {
  arm(Mode::position);
  const Setpoints some = points(2, true);
  CHECK(ask(Setpoints::kCode, &some) == Result::ok);
}
static Result do_start() { return start(); }
static void ready_to_start_drives() {
  arm(Mode::open_loop);
  Drives drives = {};
  drives.count = 8;
  CHECK(ask(Drives::kCode, &drives) == Result::ok);
}
static void ready_to_halt() {
  ready_to_start();
  CHECK(start() == Result::ok);
}
static Result do_halt() { return ask(Halt::kCode); }
static Result do_stop() { return ask(Stop::kCode); }

static void a_fault_between_two_lines_of_a_command_wins() {
  CHECK(with_a_fault_at_each_lock(ready_to_arm, do_arm, State::armed) >= 2);
  CHECK(with_a_fault_at_each_lock(ready_to_start, do_start, State::running) >= 3);
  CHECK(with_a_fault_at_each_lock(ready_to_start_drives, do_start, State::running) >= 2);
  CHECK(with_a_fault_at_each_lock(ready_to_halt, do_halt, State::armed) >= 2);
  CHECK(with_a_fault_at_each_lock(ready_to_halt, do_stop, State::idle) >= 2);
}

static void a_fault_in_a_tick_and_in_a_report_is_the_whole_truth() {
  for (uint8_t at = 0; at < 2; ++at) {
    ready_to_halt();
    tick(3);
    interrupt = press;
    locks_until = at;
    Telemetry report;
    rig.report(report);
    CHECK(!interrupt && is_stopped());
    const bool before = report.state == static_cast<uint8_t>(State::running);
    CHECK(before || report.state == static_cast<uint8_t>(State::fault));
    CHECK((report.fault == 0) == before);
    CHECK((report.flags >> static_cast<uint8_t>(Flag::bridge_enabled) & 1) == before);
  }
  ready_to_halt();
  interrupt = press;
  locks_until = 0;
  rig.tick(out);
  CHECK(is_stopped() && !out.on);
}

// ---- faults

static Inputs &still() {
  Inputs &in = rig.inputs();
  in.moved[0] = in.moved[1] = in.stepped = 0;
  memset(in.edges, 0, sizeof in.edges);
  return in;
}

// Both joints at rest under a position loop, with room to be moved by hand.
static void hold(float following_1, float following_2) {
  uint16_t detail;
  Config config = default_config();
  config.lost_step_rad() = 10;
  config.following_max_1_m() = following_1;
  config.following_max_2_rad() = following_2;
  config.speed_max_1_m_s() = 10;
  config.speed_max_2_rad_s() = 1000;
  config.feedback_2() = 1;
  config.kp_1_V_m() = 0;
  config.kp_2_1_s() = 0;
  begin(config);
  rig.inputs().flex = 3500;
  rig.inputs().supply = 500;
  tick();
  CHECK(reference() == Result::ok && arm_as(2, detail) == Result::ok);
  const Setpoints some = points(1, true);
  CHECK(ask(Setpoints::kCode, &some) == Result::ok && start() == Result::ok);
  tick(4);
}

// The fault when a joint is moved by hand: counts in every tick.
static Fault moved(uint8_t joint, int8_t by, uint16_t ticks) {
  for (uint16_t k = 0; k < ticks && rig.state() == State::running; ++k) {
    Inputs &in = still();
    in.moved[joint] = by;
    in.edges[joint][0] = in.edges[joint][1] = static_cast<uint8_t>(by < 0 ? -by / 2 : by / 2);
    rig.prepare();
    rig.tick(out);
  }
  return rig.fault();
}

static void each_joint_has_its_own_travel_following_and_speed() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    hold(10, 1000);
    CHECK(moved(0, static_cast<int8_t>(100 * sign), 15) == Fault::none);  // 1500 of 1600 counts
    CHECK(moved(0, static_cast<int8_t>(100 * sign), 4) == Fault::travel_1);
    hold(10, 1000);
    CHECK(moved(1, static_cast<int8_t>(4 * sign), 18) == Fault::none);  // 72 of 76 counts
    CHECK(moved(1, static_cast<int8_t>(4 * sign), 4) == Fault::travel_2);
    hold(0.001f, 1000);
    CHECK(moved(0, static_cast<int8_t>(10 * sign), 7) == Fault::none);  // 70 of 80 counts
    CHECK(moved(0, static_cast<int8_t>(10 * sign), 4) == Fault::following_1);
    hold(10, 0.05f);
    CHECK(moved(1, static_cast<int8_t>(2 * sign), 8) == Fault::none);  // 16 of 19 counts
    CHECK(moved(1, static_cast<int8_t>(2 * sign), 6) == Fault::following_2);
    healthy();
    // 0.05 m/s = 64 counts and one of chance in 16 ticks; joint 2 6 counts and one.
    for (uint8_t joint = 0; joint < 2; ++joint) {
      arm(Mode::position);
      const Setpoints some = points(1, true);
      CHECK(ask(Setpoints::kCode, &some) == Result::ok && start() == Result::ok);
      tick(2);
      CHECK(moved(joint, static_cast<int8_t>(sign * (joint ? 1 : 6)), 40) ==
            (joint ? Fault::speed_2 : Fault::speed_1));
    }
  }
}

static void a_lone_edge_counts_only_in_a_row() {
  FaultMonitor monitor;
  monitor.start();
  FaultLimits limits = {};
  limits.stall_duty = 10;
  limits.stall_ticks = 60000;
  limits.missed = 60000;
  limits.alone = 6;
  limits.drive[0] = Drive::motor;
  limits.drive[1] = Drive::stepper;
  limits.runaway[0] = limits.lost = limits.against = 1000000L;
  limits.travel_high[0] = limits.travel_high[1] = 1000000L;
  limits.travel_low[0] = limits.travel_low[1] = -1000000L;
  limits.following[0] = limits.following[1] = 1000000L;
  limits.speed[0] = limits.speed[1] = 30000;
  limits.flex_high = limits.supply_high = 60000;
  limits.host_ticks = 60000;
  Measured now = {};
  for (int16_t duty = 100; duty >= -100; duty = static_cast<int16_t>(duty - 200)) {
    now.duty[0] = duty;
    static const uint8_t kEdges[][2] = {{1, 0}, {2, 0}, {0, 3}, {2, 0}, {1, 1}, {3, 0}, {2, 0}};
    for (const uint8_t *edges : kEdges) {  // 3 of A, 3 of B, 2 of A, both, 5 of A
      Inputs in = {};
      in.edges[0][0] = edges[0];
      in.edges[0][1] = edges[1];
      CHECK(monitor.check(limits, in, now) == Fault::none);
      in = Inputs();
      CHECK(monitor.check(limits, in, now) == Fault::none);  // a tick without edges in between
    }
    Inputs in = {};
    in.edges[0][0] = 1;  // the sixth
    CHECK(monitor.check(limits, in, now) == Fault::encoder_1);
    monitor.start();
  }
}

// ---- session

static uint8_t sent(Session &session, uint8_t code, uint16_t sequence, const void *fields,
                    uint8_t size, uint8_t *answer) {
  uint8_t frame[kFrameMaxBytes], got = 0;
  const uint8_t length = encode(code, sequence, fields, size, frame);
  for (uint8_t k = 0; k < length; ++k) got = session.receive(frame[k], answer);
  return got;
}

static Result result_of(const uint8_t *answer, uint8_t size) {
  Receiver host;
  Result result = static_cast<Result>(255);
  for (uint8_t k = 0; k < size; ++k)
    if (host.take(answer[k]) && host.code() == Ack::kCode)
      result = static_cast<Result>(host.fields()[1]);
  return result;
}

static void a_repeated_command_has_its_own_answer_again() {
  healthy();
  Session session(rig, kBuild);
  uint8_t answer[Session::kAnswerMaxBytes], again[Session::kAnswerMaxBytes];
  const Hello hello = {kDeclaration};
  CHECK(result_of(answer, sent(session, Hello::kCode, 1, &hello, 4, answer)) == Result::ok);
  const uint8_t item = 3, none = 200;
  uint8_t size = sent(session, ConfigRead::kCode, 2, &item, 1, answer);
  CHECK(size > 20 && sent(session, ConfigRead::kCode, 2, &item, 1, again) == size);
  CHECK(memcmp(answer, again, size) == 0);
  size = sent(session, ConfigRead::kCode, 3, &none, 1, answer);
  CHECK(result_of(answer, size) == Result::out_of_range);
  CHECK(sent(session, ConfigRead::kCode, 3, &none, 1, again) == size);
  CHECK(memcmp(answer, again, size) == 0);
  // The number of the last command with another command is a replay: no answer.
  CHECK(sent(session, Keepalive::kCode, 3, nullptr, 0, again) == 0);
  size = sent(session, ProgramRead::kCode, 4, nullptr, 0, answer);
  CHECK(size > 20 && sent(session, ProgramRead::kCode, 4, nullptr, 0, again) == size);
  CHECK(memcmp(answer, again, size) == 0);

  // What contradicts itself is not stored, nor is anything while the outputs are on.
  ConfigWrite write = {static_cast<uint8_t>(Item::flex_min), 0.96f};
  size = sent(session, ConfigWrite::kCode, 5, &write, ConfigWrite::kSize, answer);
  CHECK(result_of(answer, size) == Result::ok);
  size = sent(session, ConfigSave::kCode, 6, nullptr, 0, answer);
  CHECK(result_of(answer, size) == Result::inconsistent && !session.saving());
  CHECK(ask(ConfigDefaults::kCode) == Result::ok && reference() == Result::ok);
  CHECK(!session.begin_saving());
  CHECK(sent(session, ConfigSave::kCode, 7, nullptr, 0, answer) == 0 && session.saving());
  CHECK(session.begin_saving() && !session.begin_saving());             // once
  CHECK(sent(session, ConfigSave::kCode, 7, nullptr, 0, answer) == 0);  // it takes its time
  CHECK(sent(session, Keepalive::kCode, 8, nullptr, 0, answer) == 0);
  CHECK(result_of(answer, session.saved(false, answer)) == Result::not_stored);
  CHECK(!session.begin_saving());
  const Arm arm = {2};
  size = sent(session, Arm::kCode, 8, &arm, Arm::kSize, answer);
  CHECK(result_of(answer, size) == Result::ok);
  size = sent(session, ConfigSave::kCode, 9, nullptr, 0, answer);
  CHECK(result_of(answer, size) == Result::wrong_state);

  // Another session may begin when nothing is on: not while armed or running, but in a fault.
  CHECK(result_of(answer, sent(session, Hello::kCode, 77, &hello, 4, answer)) ==
        Result::wrong_state);
  press();
  CHECK(result_of(answer, sent(session, Hello::kCode, 77, &hello, 4, answer)) == Result::ok);
}

static void tests() {
  RUN(sums_at_the_ends_of_32_bits_stay_there);
  RUN(a_sum_of_errors_stops_at_both_limits);
  RUN(the_least_gains_and_rates_count);
  RUN(settings_that_do_not_fit_the_boards_numbers_are_named);
  RUN(stored_settings_that_are_wrong_are_not_used);
  RUN(arming_asks_for_settings_firmware_mode_and_inputs);
  RUN(positions_that_32_bits_do_not_hold_are_refused);
  RUN(set_points_that_jump_or_are_too_many_are_refused);
  RUN(a_run_starts_where_the_joints_are);
  RUN(at_its_limit_the_motor_is_said_to_be_there);
  RUN(what_loses_the_position_asks_for_a_reference);
  RUN(a_reading_out_of_range_forbids_to_clear_its_own_fault_only);
  RUN(a_fault_between_two_lines_of_a_command_wins);
  RUN(a_fault_in_a_tick_and_in_a_report_is_the_whole_truth);
  RUN(each_joint_has_its_own_travel_following_and_speed);
  RUN(a_lone_edge_counts_only_in_a_row);
  RUN(a_repeated_command_has_its_own_answer_again);
}
CHECK_MAIN(tests())
