// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The control law and the observer, in fixed point and in doubles.
#include <math.h>

#include "bench.h"
#include "random.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static PidGains some_gains() {
  PidGains g;
  g.kp = 3L << 16;
  g.limit = 12800;
  g.slew = kOutputMax;
  return g;
}

static void proportional_is_exact_and_limited() {
  PidGains g = some_gains();
  Pid pid;
  PidSignals s = {100L * 256, 0, 0, 0};
  CHECK(pid.update(g, s) == 300);
  s.error = -100L * 256;
  CHECK(pid.update(g, s) == -300);
  s.error = INT32_MAX;
  CHECK(pid.update(g, s) == 12800);
  g.slew = 10;
  s.error = INT32_MIN;
  CHECK(pid.update(g, s) == 12790);
}

static void pid_equals_its_formula() {
  for (uint8_t fine = 0; fine < 2; ++fine) {
    PidGains g;
    g.fine = fine;
    g.limit = kOutputMax;
    g.slew = 500;
    g.kp = 70000;
    g.ki = 9000000;
    g.kd = 900;
    g.kf = 40000;
    g.kg = -300;
    g.kv = 500;
    g.kc = 7;
    const float unit = fine ? 16 : 1;
    Pid pid;
    float integral = 0, last = 0;
    for (uint16_t k = 0; k < 400; ++k) {
      const float e = fine ? 90 * sin(k * 0.02f) : 1500 * sin(k * 0.02f);
      PidSignals s = {static_cast<int32_t>(e * 256), static_cast<int16_t>(between(-900, 900)),
                      static_cast<int16_t>(between(-900, 900)), 0};
      const int16_t w = static_cast<int16_t>(between(-900, 900)),
                    w_rate = static_cast<int16_t>(between(-900, 900));
      s.added = added_terms(g, w, w_rate, 0);
      const float units = floor(s.error / 256.0f * unit);
      const float grown = integral + g.ki / 4294967296.0f * units;
      const float u = g.kp / 65536.0f * units + grown +
                      g.kd / 65536.0f * (s.setpoint_rate - s.rate) + g.kf / 65536.0f * w +
                      g.kg / 65536.0f * w_rate + g.kv / 65536.0f * s.setpoint_rate +
                      (s.setpoint_rate > 0 ? 7
                       : s.setpoint_rate   ? -7
                                           : 0);
      const float held = fmin(fmax(u, last - 500), last + 500);
      if (!(u > held + 1 && units >= 0) && !(u < held - 1 && units < 0)) integral = grown;
      last = pid.update(g, s);
      CHECK(fabs(last - held) < 4);
    }
  }
}

static void integral_stops_at_the_limit() {
  PidGains g = some_gains();
  g.kp = 0;
  g.ki = 1L << 26;
  Pid pid;
  PidSignals s = {20000L * 256, 0, 0, 0};
  for (uint16_t k = 0; k < 2000; ++k) pid.update(g, s);
  CHECK(pid.output() <= 12800 && pid.output() > 12000);
  s.error = -20000L * 256;
  uint16_t ticks = 0;
  while (pid.update(g, s) > 0) ++ticks;
  CHECK(ticks < 45);  // 12800 / (2^26 / 2^32 x 20000) = 41: no windup to undo
}

// The integral grows by one unit of output in each tick, from -150 or 150 that another term holds:
// it stops within the limit of 100, at 99 and at -100, and the output is far from its own limit.
static void integral_stops_at_the_limit_below_the_output() {
  PidGains g;
  g.ki = 1L << 22;
  g.limit = 100;
  g.slew = kOutputMax;
  for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
    Pid pid;
    const int32_t error = sign * (1024L * 256), held = sign * (-150L * 65536);
    const PidSignals s = {error, 0, 0, held};
    for (uint16_t k = 0; k < 300; ++k) pid.update(g, s);
    CHECK(pid.output() == (sign > 0 ? 99 - 150 : -100 + 150));
  }
}

static void an_observer_equals_its_formula() {
  ObserverGains g;
  g.moving = 70000;
  g.inertia = 400000;
  g.filter = 3000;
  DisturbanceObserver observer;
  observer.start();
  float filtered = 0;
  for (uint16_t k = 0; k < 400; ++k) {
    const int16_t output = static_cast<int16_t>(between(-16000, 16000)),
                  rate = static_cast<int16_t>(between(-900, 900));
    filtered += g.filter / 65536.0f * (output + g.moving / 65536.0f * rate - filtered);
    const float expected = filtered - g.inertia / 65536.0f * rate;
    CHECK(fabs(observer.update(g, output, rate) / 65536.0f - expected) < 0.1f);
  }
  g.filter = 0;
  CHECK(observer.update(g, 16000, 900) == 0);  // there is none
}

// A joint that moves as the nominal one against a constant load: the observer finds the load.
static void an_observer_finds_a_load() {
  Config config = default_config();
  config.observer_1_Hz() = 10;
  config.jo_1_V_s2_m() = 1;
  config.bo_1_V_s_m() = 20;
  FixedPointConfig fixed;
  CHECK(to_fixed_point(config, fixed) == kAllValid);
  CHECK(fixed.observer[1].filter == 0);
  const float volt = 16 * kDutyFull / 12.0f, count = 80000, load = 2;
  DisturbanceObserver observer;
  float speed = 0, found = 0;  // m/s, V
  for (uint16_t k = 0; k < 600; ++k) {
    const float asked = 3 + sin(k * 0.02f);
    const int16_t output = static_cast<int16_t>(asked * volt);
    speed += 0.001f * (asked - 20 * speed - load);
    if (k & 1) continue;
    found = observer.update(fixed.observer[0], output,
                            static_cast<int16_t>(floor(speed * count * 0.256f + 0.5f))) /
            65536.0f / volt;
  }
  CHECK(fabs(found - load) < 0.02f);
}
#ifndef __AVR__
static void the_law_in_doubles_is_its_formula_to_the_digit() {
  GainsOf<ModelNumbers> g;
  g.kp = 3;
  g.ki = 0.5;
  g.kd = 0.25;
  g.kv = 0.125;
  g.kc = 2;
  g.limit = 40;
  g.slew = 9;
  PidOf<ModelNumbers> pid;
  double integral = 0, last = 0;
  for (uint16_t k = 0; k < 400; ++k) {
    const double e = between(-64, 64) / 4.0, rate = between(-64, 64), setpoint = between(-8, 8),
                 tip = between(-16, 16);
    const SignalsOf<ModelNumbers> s = {e, rate, setpoint, tip};
    double grown = integral + 0.5 * e;
    if (grown > 40 || grown < -40) grown = integral;
    const double u = grown + tip + 3 * e + 0.25 * (setpoint - rate) + 0.125 * setpoint +
                     (setpoint > 0   ? 2
                      : setpoint < 0 ? -2
                                     : 0);
    const double limited = u > 40 ? 40 : u < -40 ? -40 : u;
    const double held = limited > last + 9 ? last + 9 : limited < last - 9 ? last - 9 : limited;
    if (!(u > held && e >= 0) && !(u < held && e < 0)) integral = grown;
    last = held;
    CHECK(pid.update(g, s) == held);
  }
}

static void an_observer_in_doubles_is_its_formula_to_the_digit() {
  ObserverGainsOf<ModelNumbers> g;
  g.moving = 1.5;
  g.inertia = 4;
  g.filter = 0.25;
  DisturbanceObserverOf<ModelNumbers> observer;
  double filtered = 0;
  for (uint8_t k = 0; k < 20; ++k) {
    const double output = between(-64, 64), rate = between(-64, 64);
    filtered += 0.25 * (output + 1.5 * rate - filtered);
    CHECK(observer.update(g, output, rate) == filtered - 4 * rate);
  }
  observer.start();
  CHECK(observer.update(g, 8, 0) == 2);
  g.filter = 0;
  CHECK(observer.update(g, 8, 8) == 0);  // there is none
}

static void a_sum_at_its_limit_is_not_outside() {
  using Sum = ModelNumbers::Accumulator;
  CHECK(!ModelNumbers::outside(Sum(2.0), 2.0) && !ModelNumbers::outside(Sum(-2.0), 2.0));
  CHECK(ModelNumbers::outside(Sum(2.25), 2.0) && ModelNumbers::outside(Sum(-2.25), 2.0));
  CHECK(!ModelNumbers::outside(Sum(0.0), 2.0) && Sum().sum == 0.0);
  CHECK(ModelNumbers::outside(Sum(NAN), 2.0));
}
#endif

static void tests() {
  RUN(proportional_is_exact_and_limited);
  RUN(pid_equals_its_formula);
  RUN(integral_stops_at_the_limit);
  RUN(integral_stops_at_the_limit_below_the_output);
  RUN(an_observer_equals_its_formula);
  RUN(an_observer_finds_a_load);
#ifndef __AVR__
  RUN(the_law_in_doubles_is_its_formula_to_the_digit);
  RUN(an_observer_in_doubles_is_its_formula_to_the_digit);
  RUN(a_sum_at_its_limit_is_not_outside);
#endif
}
CHECK_MAIN(tests())
