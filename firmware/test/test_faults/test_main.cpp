// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The fault monitor to the tick and to the count: at its limit nothing, one beyond it the fault.
// Each is tried on a new monitor, and on one that was in the midst of every other fault before
// start().
#include <string.h>

#include "check.h"
#include "rig.h"

using namespace flexura;

CriticalSection::CriticalSection() : before_(0) {}
CriticalSection::~CriticalSection() { (void)before_; }
InterruptLock::InterruptLock() : before_(0) {}
InterruptLock::~InterruptLock() { (void)before_; }

static FaultMonitor monitor;
static FaultLimits limits;
static Inputs in;
static Measured now;
static bool used;  // the monitor has seen much before

// Limits of which each is another number.
static void set_limits() {
  limits = FaultLimits();
  limits.drive[0] = Drive::motor;
  limits.drive[1] = Drive::stepper;
  limits.travel_low[0] = -1000;
  limits.travel_high[0] = 1100;
  limits.travel_low[1] = -1200;
  limits.travel_high[1] = 1300;
  limits.speed[0] = 160;
  limits.speed[1] = 96;
  limits.stall_duty = 50;
  limits.stall_speed[0] = 20;
  limits.stall_ticks = 30;
  limits.runaway[0] = 40;
  limits.lost = 5000;
  limits.against = 12;
  limits.following[0] = 700;
  limits.following[1] = 800;
  limits.missed = 4;
  limits.alone = 9;
  limits.flex_low = 200;
  limits.flex_high = 3900;
  limits.supply_low = 400;
  limits.supply_high = 600;
  limits.host_ticks = 100;
}

static void at_rest() {
  in = Inputs();
  in.flex = 2000;
  in.supply = 500;
  now = Measured();
}

// As near to every fault as can be without one, and then begun anew.
static void begin() {
  set_limits();
  monitor = FaultMonitor();
  at_rest();
  if (used) {
    for (uint8_t k = 0; k < 3; ++k) {
      in.supply = 300;
      in.flex = 100;
      now.duty[0] = 100;
      in.edges[0][0] = in.edges[1][1] = 2;
      in.missed[0] = in.missed[1] = 1;
      in.stepped = 1;
      in.moved[0] = in.moved[1] = -3;
      CHECK(monitor.check(limits, in, now) == Fault::none);
    }
    at_rest();
    now.duty[0] = 100;
    for (uint8_t k = 0; k < 20; ++k) CHECK(monitor.check(limits, in, now) == Fault::none);
    for (uint8_t k = 0; k < 3; ++k) {
      in.supply = 300;
      in.flex = 100;
      in.moved[0] = in.moved[1] = -10;
      CHECK(monitor.check(limits, in, now) == Fault::none);
    }
    at_rest();
  }
  monitor.start();
}

// The tick in which the first fault is found, counted from 1, if it is this one; 0 if it is another
// or none within `most`.
static uint16_t until(Fault fault, uint16_t most = 400) {
  for (uint16_t k = 1; k <= most; ++k) {
    const Fault found = monitor.check(limits, in, now);
    if (found == fault) return k;
    if (found != Fault::none) return 0;
  }
  return 0;
}
static bool quiet(uint16_t ticks) {
  for (; ticks > 0; --ticks)
    if (monitor.check(limits, in, now) != Fault::none) return false;
  return true;
}
static void both(void (*test)()) {
  used = false;
  test();
  used = true;
  test();
}

static void silence() {
  begin();
  CHECK(until(Fault::host_silent) == 101);
  begin();
  CHECK(quiet(100));
  monitor.host_spoke();
  CHECK(until(Fault::host_silent) == 101);
}

static void switches_and_their_order() {
  static const Fault kFaults[] = {Fault::emergency_stop, Fault::limit_low, Fault::limit_high};
  for (uint8_t k = 0; k < 3; ++k) {
    begin();
    in.supply = 0;
    in.switches = static_cast<uint8_t>(7 << k & 7);  // the first of several is the reason
    CHECK(until(kFaults[k]) == 1);
    CHECK(standing(limits, in) == kFaults[k]);
  }
  begin();
  in.switches = 0xF8;  // no switch
  CHECK(standing(limits, in) == Fault::none && quiet(20));
}

static void readings() {
  static const struct {
    uint16_t flex, supply;
    Fault fault;
  } kReadings[] = {{2000, 399, Fault::supply_low},
                   {2000, 601, Fault::supply_high},
                   {199, 500, Fault::flex_low},
                   {3901, 500, Fault::flex_high},
                   {199, 399, Fault::supply_low}};
  for (const auto &reading : kReadings) {
    begin();
    in.flex = reading.flex;
    in.supply = reading.supply;
    CHECK(standing(limits, in) == reading.fault);
    CHECK(until(reading.fault) == 4);
    begin();
    for (uint8_t k = 0; k < 5; ++k) {  // three ticks are noise, again and again
      in.flex = reading.flex;
      in.supply = reading.supply;
      CHECK(quiet(3));
      in.flex = 2000;
      in.supply = 500;
      CHECK(quiet(1));
    }
  }
  static const uint16_t kFine[][2] = {{200, 400}, {3900, 600}};
  for (const auto &fine : kFine) {
    begin();
    in.flex = fine[0];
    in.supply = fine[1];
    CHECK(standing(limits, in) == Fault::none && quiet(50));
  }
}

static void missed_edges() {
  for (uint8_t j = 0; j < 2; ++j) {
    const Fault fault = j ? Fault::encoder_2 : Fault::encoder_1;
    begin();
    in.missed[j] = 1;
    CHECK(until(fault) == 5);
    begin();
    in.missed[j] = 4;
    CHECK(quiet(1));
    in.missed[j] = 0;
    CHECK(quiet(50));
    in.missed[j] = 1;
    CHECK(until(fault) == 1);  // the count stays until the next start
    begin();
    in.flooded[j] = true;
    CHECK(until(fault) == 1);
  }
}

static void lone_edges_of_joint_1() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    begin();
    now.velocity[0] = 1000;  // no stall
    now.duty[0] = static_cast<int16_t>(51 * sign);
    in.edges[0][0] = 1;
    CHECK(until(Fault::encoder_1) == 9);
    begin();
    now.velocity[0] = 1000;
    now.duty[0] = static_cast<int16_t>(50 * sign);  // not driven
    in.edges[0][0] = 3;
    CHECK(quiet(60));
    now.duty[0] = static_cast<int16_t>(51 * sign);  // what trembled before does not count
    CHECK(until(Fault::encoder_1) == 3);
    begin();
    now.velocity[0] = 1000;
    now.duty[0] = static_cast<int16_t>(51 * sign);
    in.edges[0][1] = 4;
    CHECK(quiet(2));
    now.duty[0] = 0;  // not driven for a tick: forgotten
    CHECK(quiet(1));
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(quiet(2) && until(Fault::encoder_1) == 1);
  }
  begin();
  now.velocity[0] = 1000;
  now.duty[0] = 100;
  for (uint8_t k = 0; k < 40; ++k) {  // alternating lines: a shaft that turns
    in.edges[0][k & 1] = 8;
    in.edges[0][~k & 1] = 0;
    CHECK(quiet(1));
  }
  in.edges[0][0] = 8;
  in.edges[0][1] = 0;  // after 8 of line B
  CHECK(quiet(1) && until(Fault::encoder_1) == 1);
  begin();
  now.velocity[0] = 1000;
  now.duty[0] = 100;
  in.edges[0][0] = 8;
  CHECK(quiet(1));
  in.edges[0][1] = 1;  // both in one tick: begun anew
  CHECK(quiet(30));
  in.edges[0][1] = 0;
  CHECK(quiet(1) && until(Fault::encoder_1) == 1);
}

static void lone_edges_of_joint_2() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    begin();
    in.edges[1][1] = 9;
    CHECK(quiet(90));  // no step yet: a strip that rings
    monitor.host_spoke();
    in.stepped = sign;
    in.edges[1][1] = 1;
    CHECK(until(Fault::encoder_2) == 9);
    begin();
    in.stepped = sign;
    CHECK(quiet(1));
    in.stepped = 0;
    CHECK(quiet(49));
    in.edges[1][0] = 8;  // in the 50th tick after the step
    CHECK(quiet(1));
    CHECK(quiet(20));  // from the 51st on nobody looks
    in.stepped = sign;
    in.edges[1][0] = 1;
    CHECK(until(Fault::encoder_2) == 1);  // the same direction: the count goes on
    begin();
    in.stepped = sign;
    in.edges[1][0] = 8;
    CHECK(quiet(1));
    in.stepped = static_cast<int8_t>(-sign);  // a turn crosses the same edge again
    CHECK(quiet(1));
    in.edges[1][0] = 1;
    CHECK(until(Fault::encoder_2) == 1);
    begin();
    in.stepped = static_cast<int8_t>(3 * sign);
    in.edges[1][0] = 4;
    CHECK(quiet(2));
    in.stepped = sign;  // fewer steps in the same direction are no turn
    in.edges[1][0] = 1;
    CHECK(until(Fault::encoder_2) == 1);
  }
}

static void running_away_and_standing_still() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    begin();
    now.velocity[0] = 1000;
    now.duty[0] = static_cast<int16_t>(51 * sign);
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    CHECK(until(Fault::runaway_1) == 21);  // 42 counts against a drive; 40 are allowed
    begin();
    now.velocity[0] = 1000;
    now.duty[0] = static_cast<int16_t>(51 * sign);
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    CHECK(quiet(20));
    in.moved[0] = static_cast<int8_t>(sign);  // with the drive again: forgotten as far as it goes
    CHECK(quiet(10));
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    CHECK(until(Fault::runaway_1) == 6);
    begin();
    now.velocity[0] = 1000;
    now.duty[0] = static_cast<int16_t>(51 * sign);
    in.moved[0] = static_cast<int8_t>(4 * sign);  // far with the drive gives no credit
    CHECK(quiet(20));
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    CHECK(until(Fault::runaway_1) == 21);
    begin();
    now.velocity[0] = 1000;
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(quiet(20));
    now.duty[0] = 0;  // no drive, nothing against it
    CHECK(quiet(1));
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(until(Fault::runaway_1) == 21);

    begin();
    now.duty[0] = static_cast<int16_t>(51 * sign);
    now.velocity[0] = static_cast<int16_t>(20 * sign);
    CHECK(until(Fault::stall_1) == 30);
    begin();
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(quiet(29));
    now.velocity[0] = static_cast<int16_t>(-21 * sign);  // it moves for a tick
    CHECK(quiet(1));
    now.velocity[0] = 0;
    CHECK(until(Fault::stall_1) == 30);
    begin();
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(quiet(29));
    now.duty[0] = static_cast<int16_t>(50 * sign);  // not driven for a tick: forgotten
    CHECK(quiet(1));
    now.duty[0] = static_cast<int16_t>(51 * sign);
    CHECK(until(Fault::stall_1) == 30);
    begin();
    now.duty[0] = static_cast<int16_t>(50 * sign);
    CHECK(quiet(90));
    begin();
    limits.stall_duty = 0;  // the least drive counts
    now.velocity[0] = 1000;
    now.duty[0] = sign;
    in.moved[0] = static_cast<int8_t>(-2 * sign);
    CHECK(until(Fault::runaway_1) == 21);
  }
}

static void steps_that_are_lost() {
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    begin();
    now.lag = 5000L * sign;
    CHECK(quiet(20));
    now.lag = 5001L * sign;
    CHECK(until(Fault::stall_2) == 1);
    for (uint8_t counts = 12; counts <= 13; ++counts) {  // how far it went the other way
      begin();
      in.stepped = sign;
      CHECK(quiet(1));
      in.stepped = 0;
      in.moved[1] = static_cast<int8_t>(-sign * counts);
      CHECK(quiet(1));
      in.moved[1] = 0;
      now.lag = 5001L * sign;
      CHECK(until(counts == 12 ? Fault::stall_2 : Fault::runaway_2) == 1);
    }
    for (uint8_t edges = 3; edges <= 4; ++edges) {  // of one line alone
      begin();
      in.stepped = sign;
      in.edges[1][1] = edges;
      CHECK(quiet(1));
      in.stepped = 0;
      in.edges[1][1] = 0;
      now.lag = 5001L * sign;
      CHECK(until(edges == 3 ? Fault::stall_2 : Fault::encoder_2) == 1);
    }
    begin();
    in.moved[1] = static_cast<int8_t>(-5 * sign);  // no step yet: against nothing
    CHECK(quiet(10));
    now.lag = 5001L * sign;
    in.moved[1] = 0;
    CHECK(until(Fault::stall_2) == 1);
  }
}

static void places() {
  for (uint8_t j = 0; j < 2; ++j) {
    static const int32_t kEnds[2][2] = {{-1000, 1100}, {-1200, 1300}};
    for (uint8_t high = 0; high < 2; ++high) {
      begin();
      now.position[j] = kEnds[j][high];
      CHECK(quiet(40));
      now.position[j] += high ? 1 : -1;
      const uint16_t found = until(j ? Fault::travel_2 : Fault::travel_1);
      CHECK(found == 1 || found == 2);  // one joint in each tick
      begin();
      now.error[j] = (j ? 800L : 700L) * (high ? 1 : -1);
      now.tracking = true;
      CHECK(quiet(40));
      now.error[j] += high ? 1 : -1;
      now.tracking = false;
      CHECK(quiet(40));
      now.tracking = true;
      const uint16_t beyond = until(j ? Fault::following_2 : Fault::following_1);
      CHECK(beyond == 1 || beyond == 2);
    }
  }
}

// Counts in a window of 16 ticks; joint 1's windows end in even ticks, joint 2's one tick later.
static void speeds() {
  for (uint8_t j = 0; j < 2; ++j)
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      begin();
      now.position[0] = now.position[1] = 0;
      in.moved[j] = static_cast<int8_t>(sign * (j ? 6 : 10));  // 96 and 160 in 16 ticks: just so
      CHECK(quiet(90));
      monitor.host_spoke();
      in.moved[j] = static_cast<int8_t>(sign * (j ? 7 : 11));
      const uint16_t found = until(j ? Fault::speed_2 : Fault::speed_1);
      CHECK(found > 0 && found <= 18);
      begin();
      CHECK(quiet(1));
      in.moved[j] = static_cast<int8_t>(sign * 100);  // 200 counts in a window, and back
      CHECK(quiet(1));
      in.moved[j] = static_cast<int8_t>(sign * -100);
      CHECK(quiet(1));
      in.moved[j] = 0;
      CHECK(quiet(32));
      begin();
      CHECK(quiet(20));
      in.moved[j] = static_cast<int8_t>(sign * 60);  // found at the end of the second window
      CHECK(until(j ? Fault::speed_2 : Fault::speed_1) == (j ? 13 : 12));
      // From the start of a window the fault comes at its end: 16 ticks for joint 1, 17 for
      // joint 2.
      begin();
      in.moved[j] = static_cast<int8_t>(sign * 60);
      CHECK(until(j ? Fault::speed_2 : Fault::speed_1) == (j ? 17 : 16));
    }
}

static void nothing_drives_joint_1() {
  begin();
  now.duty[0] = 100;
  CHECK(until(Fault::stall_1) == 30);
  begin();
  limits.drive[0] = Drive::none;
  now.duty[0] = 100;
  CHECK(quiet(60));
}

static void silence_and_all_others() {
  both(silence);
  both(switches_and_their_order);
}
static void readings_beyond_their_range_for_four_ticks() { both(readings); }
static void edges_that_were_missed() { both(missed_edges); }
static void edges_of_one_line_alone() {
  both(lone_edges_of_joint_1);
  both(lone_edges_of_joint_2);
}
static void a_motor_that_stands_or_runs_away() {
  both(running_away_and_standing_still);
  both(nothing_drives_joint_1);
}
static void a_stepper_that_does_not_follow() { both(steps_that_are_lost); }
static void joints_out_of_their_place() { both(places); }
static void joints_that_are_too_fast() { both(speeds); }

static void tests() {
  RUN(silence_and_all_others);
  RUN(readings_beyond_their_range_for_four_ticks);
  RUN(edges_that_were_missed);
  RUN(edges_of_one_line_alone);
  RUN(a_motor_that_stands_or_runs_away);
  RUN(a_stepper_that_does_not_follow);
  RUN(joints_out_of_their_place);
  RUN(joints_that_are_too_fast);
}
CHECK_MAIN(tests())
