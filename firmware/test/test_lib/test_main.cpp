// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Unit tests of lib/: on the host under its sanitizers, and unchanged on an emulated AVR, where an
// int has 16 bits.
#include <math.h>
#include <string.h>

#include "bench.h"
#include "check.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

using namespace flexura;

static uint32_t seed = 1;
static uint32_t random32() {
  seed ^= seed << 13;
  seed ^= seed >> 17;
  return seed ^= seed << 5;
}
static int32_t between(int32_t least, int32_t most) {
  return least + static_cast<int32_t>(random32() % static_cast<uint32_t>(most - least + 1));
}

// ---- numeric

static const int16_t kEdges[] = {0, 1, -1, 255, -256, INT16_MAX, INT16_MIN};

static void products_equal_exact_ones() {
  for (uint16_t k = 0; k < 600; ++k) {
    const int32_t a =
        k < 49 ? kEdges[k % 7] * 65536L + kEdges[k / 7] : static_cast<int32_t>(random32());
    const int16_t b = k < 343 ? kEdges[k / 49 % 7] : static_cast<int16_t>(random32());
    const uint16_t c = static_cast<uint16_t>(b);
    const int64_t exact = static_cast<int64_t>(a) * b;
    CHECK(signed_product(upper(a), b) == static_cast<int32_t>(upper(a)) * b);
    CHECK(mixed_product(lower(a), b) == static_cast<int32_t>(static_cast<int64_t>(lower(a)) * b));
    CHECK(unsigned_product(lower(a), c) == static_cast<uint32_t>(lower(a)) * c);
    CHECK(multiply_high(a, b) == static_cast<int32_t>(exact >> 16));
    CHECK(multiply_q16(a, c) == static_cast<int32_t>(static_cast<int64_t>(a) * c >> 16));
    CHECK(multiply(a, b) == (exact > kInt32Max   ? kInt32Max
                             : exact < kInt32Min ? kInt32Min
                                                 : static_cast<int32_t>(exact)));
    const int64_t total = static_cast<int64_t>(a) + b;
    CHECK(add(a, b) == (total > kInt32Max   ? kInt32Max
                        : total < kInt32Min ? kInt32Min
                                            : static_cast<int32_t>(total)));
  }
}

static void halves_go_up() {
  for (uint16_t k = 0; k < 600; ++k) {
    const int32_t a =
        k < 49 ? kEdges[k % 7] * 65536L + kEdges[k / 7] : static_cast<int32_t>(random32());
    if (a <= kInt32Max - 0x8000L)
      CHECK(nearest(a) == static_cast<int16_t>((static_cast<int64_t>(a) + 0x8000) >> 16));
  }
  CHECK(nearest(0x7fff) == 0 && nearest(0x8000) == 1 && nearest(-0x8000L) == 0);
}

static void sums_equal_exact_ones() {
  for (uint8_t k = 0; k < 200; ++k) {
    const int32_t start = static_cast<int32_t>(random32());
    Accumulator48 sum(start);
    int64_t exact = start;
    for (uint8_t n = 0; n < 6; ++n) {
      const int32_t a = k < 7 ? (k & 1 ? (1L << 23) - 1 : -(1L << 23) + 1)
                              : static_cast<int32_t>(random32()) >> 8;
      const int16_t b = k < 7 ? kEdges[k] : static_cast<int16_t>(random32());
      sum.add(a, b);
      exact += static_cast<int64_t>(a) * b;
    }
    const int32_t a = static_cast<int32_t>(random32());
    const int16_t b = static_cast<int16_t>(random32());
    sum.add_scaled(a, b);
    exact += static_cast<int64_t>(a) * b;
    const int32_t more = static_cast<int32_t>(random32());
    sum.add(more);
    exact += more;
    CHECK(sum.value() == (exact > kInt32Max   ? kInt32Max
                          : exact < kInt32Min ? kInt32Min
                                              : static_cast<int32_t>(exact)));
    CHECK(sum.integer_part() == static_cast<int32_t>(exact >> 16));
    CHECK(sum.high_word() == static_cast<int16_t>(exact >> 32));
  }
}

static void what_is_not_finite_is_no_number() {
  int32_t fixed;
  CHECK(to_fixed(-1.5f, 65536.0f, fixed) && fixed == -98304);
  Accumulator48 small(7);
  small.add(-9);
  CHECK(small.value() == -2);
  CHECK(!to_fixed(NAN, 1.0f, fixed) && !to_fixed(INFINITY, 1.0f, fixed) &&
        !to_fixed(40000.0f, 65536.0f, fixed));
}

// ---- protocol

static void crc_is_the_published_one() {
  CHECK(crc32(reinterpret_cast<const uint8_t *>("123456789"), 9) == 0xCBF43926ul);
}

static bool receive(Receiver &receiver, const uint8_t *frame, uint8_t size) {
  bool good = false;
  for (uint8_t k = 0; k < size; ++k) good = receiver.take(frame[k]);
  return good;
}

static void frames_of_all_lengths_come_back() {
  Receiver receiver;
  uint8_t fields[kPayloadMaxBytes], frame[kFrameMaxBytes];
  for (uint8_t size = 0; size <= kPayloadMaxBytes - kHeadBytes; ++size) {
    for (uint8_t k = 0; k < size; ++k)
      fields[k] = size & 1 ? 0 : static_cast<uint8_t>(random32() & random32());
    const uint8_t length = encode(size, 0x0100, fields, size, frame);
    CHECK(length <= kFrameMaxBytes && memchr(frame, 0, length) == frame + length - 1);
    CHECK(receive(receiver, frame, length));
    CHECK(receiver.code() == size && receiver.sequence() == 0x0100 && receiver.size() == size);
    CHECK(memcmp(receiver.fields(), fields, size) == 0);
  }
}

static void damaged_frames_are_none_and_cost_no_other() {
  Receiver receiver;
  const Hello hello = {kDeclaration};
  uint8_t good[kFrameMaxBytes], bad[kFrameMaxBytes];
  const uint8_t length = encode(7, hello, good);
  for (uint8_t k = 0; k + 1 < length; ++k) {
    for (uint8_t bit = 0; bit < 8; ++bit) {
      memcpy(bad, good, length);
      bad[k] = static_cast<uint8_t>(bad[k] ^ 1 << bit);
      CHECK(!receive(receiver, bad, length));
      CHECK(!receiver.take(0));
    }
    CHECK(!receive(receiver, good + k + 1, static_cast<uint8_t>(length - k - 1)));  // cut short
    CHECK(receive(receiver, good, length));
  }
  for (uint16_t k = 0; k < 700; ++k) CHECK(!receiver.take(static_cast<uint8_t>(1 + k % 255)));
  CHECK(!receiver.take(0));
  CHECK(receive(receiver, good, length));
}

// ---- sensing

static void four_edges_are_four_counts() {
  static const uint8_t up[] = {2, 3, 1, 0}, down[] = {1, 3, 2, 0};
  Quadrature q;
  q.start(0);
  for (uint8_t k = 0; k < 4; ++k) CHECK(q.update(k & 1 ? EncoderLine::b : EncoderLine::a, up[k]));
  CHECK(q.count == 4 && q.missed == 0);
  for (uint8_t k = 0; k < 4; ++k) q.update(k & 1 ? EncoderLine::a : EncoderLine::b, down[k]);
  CHECK(q.count == 0 && q.missed == 0);
  CHECK(q.take_edges(EncoderLine::a) == 4 && q.take_edges(EncoderLine::b) == 4 &&
        q.take_edges(EncoderLine::a) == 0);
  q.update(EncoderLine::a, 3);
  CHECK(q.missed == 1);
  uint8_t n = 1;
  while (q.update(EncoderLine::a, n & 1 ? 2 : 0)) ++n;
  CHECK(n < Quadrature::kEdgesMax);
}

static void deflection_follows_its_polynomial() {
  Config config = default_config();
  config.flex_zero() = 0.6f;
  config.flex_c1_m() = -0.45f;
  config.flex_c2_m() = 0.7f;
  config.flex_c3_m() = -1.1f;
  FixedPointConfig fixed;
  CHECK(to_fixed_point(config, fixed) == kAllValid);
  for (uint16_t reading = 0; reading <= 2 * 1023 * kAdcSamples;
       reading = static_cast<uint16_t>(reading + 97)) {
    const float x = reading / (2.0f * 1024 * kAdcSamples) - config.flex_zero();
    const float w = ((config.flex_c3_m() * x + config.flex_c2_m()) * x + config.flex_c1_m()) * x;
    const float slope =
        (3 * config.flex_c3_m() * x + 2 * config.flex_c2_m()) * x + config.flex_c1_m();
    // A tenth of its unit of 10 um, and half a reading, to which the zero is rounded.
    CHECK(fabs(FlexSensor::raw(fixed.tip, reading) / 25.6e6f - w) <
          1e-6f + fabs(slope) * 0.5f / (2 * 1024 * kAdcSamples));
  }
}

static void filtered_velocity_has_its_time_constant() {
  const uint16_t filter = static_cast<uint16_t>(65536 * (1 - exp(-0.01)));  // 100 ticks
  Velocity velocity;
  float exact = 0;
  for (uint16_t k = 0; k < 500; ++k) {
    velocity.update(10, filter);
    exact += (10 - exact) * filter / 65536.0f;
    if (k % 50 == 0) CHECK(fabs(velocity.value() / 256.0f - exact) < 0.01f);
  }
}

// ---- control

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

// ---- motion

static void steps_come_when_they_are_due() {
  StepGenerator steps;
  StepPlan plan;
  steps.start(1000);
  int32_t given = 1000;
  float position = 1000, last = -1e9f;
  bool up = true;
  int16_t rate = 0;
  for (uint16_t tick = 0; tick < 1500; ++tick) {
    if (tick % 50 == 0)
      rate = static_cast<int16_t>(tick % 300 == 0   ? 16383
                                  : tick % 350 == 0 ? -16383
                                                    : between(-16383, 16383));
    steps.plan(rate, plan);
    CHECK(plan.count <= kStepsPerTick);
    for (uint8_t k = 0; k < plan.count; ++k) {
      CHECK(plan.up == (rate > 0) && plan.at[k] <= kTickCounts);
      // A step is due where the position has gone 3/4 beyond those given.
      const float due =
          (given + (plan.up ? 0.75f : -0.75f) - position) / (rate / 4096.0f) * kTickCounts;
      CHECK(fabs(due - plan.at[k]) < 3);  // 1.5 us
      const float now = tick * static_cast<float>(kTickCounts) + plan.at[k];
      CHECK(now - last > (plan.up == up ? 490 : 240));  // 4000 a second; half a step after a turn
      last = now;
      up = plan.up;
      given += plan.up ? 1 : -1;
    }
    position += rate / 4096.0f;
    CHECK(steps.given() == given && fabs(position - given) <= 0.751f);
    CHECK(fabs(steps.position() / 256.0f - position) < 0.01f);
  }
}

static TrajectoryPlayer player;
static const uint16_t kUnfiltered[2] = {0, 0};

static void cubic_goes_through_its_knots() {
  for (uint8_t log2 = 0; log2 <= 6; ++log2) {
    Knot knots[9];
    player.clear();
    for (uint8_t k = 0; k < 9; ++k) {
      for (uint8_t j = 0; j < 2; ++j) {
        knots[k].position[j] = between(-1000000, 1000000);
        knots[k].velocity[j] = static_cast<int16_t>(between(-3000, 3000));
      }
      player.add(knots[k], k == 8);
    }
    Tick tick = {{0, 0}};
    player.start(log2, true, kUnfiltered);
    const uint8_t period = static_cast<uint8_t>(1 << log2);
    for (uint8_t k = 0; k < 8; ++k)
      for (uint8_t n = 1; n <= period; ++n) {
        CHECK(player.advance(tick) == TrajectoryPlayer::Event::playing);
        player.prepare();
        const float s = n / static_cast<float>(period), r = 1 - s;
        for (uint8_t j = 0; j < 2; ++j) {
          const float p0 = knots[k].position[j], p1 = knots[k + 1].position[j];
          const float v0 = knots[k].velocity[j] * static_cast<float>(period),
                      v1 = knots[k + 1].velocity[j] * static_cast<float>(period);
          const float exact = p0 + (p1 - p0) * s * s * (3 - 2 * s) + s * r * (r * v0 - s * v1);
          CHECK(fabs(tick.of[j] - exact) < 5);  // 5/256 counts, most of it this float's
          if (n == period) CHECK(tick.of[j] == knots[k + 1].position[j]);
        }
      }
    TrajectoryPlayer::Event event = player.advance(tick);
    for (uint8_t n = 0; n < 3 && event == TrajectoryPlayer::Event::playing; ++n)
      event = player.advance(tick);
    CHECK(event == TrajectoryPlayer::Event::final && tick.of[0] == knots[8].position[0]);
  }
}

static void a_missing_knot_is_an_underrun() {
  player.clear();
  const Knot knot = {{5, 6}, {0, 0}};
  player.add(knot, false);
  player.add(knot, false);
  player.start(3, true, kUnfiltered);
  Tick tick = {{0, 0}};
  uint8_t n = 0;
  while (player.advance(tick) == TrajectoryPlayer::Event::playing) player.prepare(), ++n;
  CHECK(n == 8 && player.advance(tick) == TrajectoryPlayer::Event::underrun);
  player.add(knot, false);
  player.prepare();
  CHECK(player.advance(tick) == TrajectoryPlayer::Event::playing && player.next_index() == 3);
}

static void drives_hold_for_their_period_and_end_in_nothing() {
  player.clear();
  for (int16_t k = 1; k <= 3; ++k)
    player.add({{0, 0}, {static_cast<int16_t>(100 * k), static_cast<int16_t>(-k)}}, k == 3);
  player.start(2, false, kUnfiltered);
  Tick tick;
  for (int16_t n = 0; n < 12; ++n) {
    CHECK(player.advance(tick) == TrajectoryPlayer::Event::playing);
    CHECK(tick.of[0] == 100 * (n / 4 + 1) && tick.of[1] == -(n / 4 + 1));
  }
  CHECK(player.advance(tick) == TrajectoryPlayer::Event::playing && tick.of[0] == 0 &&
        tick.of[1] == 0);
  CHECK(player.advance(tick) == TrajectoryPlayer::Event::final);
}

static void a_filtered_setpoint_arrives() {
  const uint16_t slow[2] = {4000, 4000};
  player.clear();
  player.add({{0, 0}, {0, 0}}, false);
  player.add({{100000, -100000}, {0, 0}}, true);
  player.start(0, true, slow);
  Tick tick = {{0, 0}};
  uint16_t n = 0;
  for (; player.advance(tick) == TrajectoryPlayer::Event::playing; ++n) player.prepare();
  CHECK(n > 50 && n < 400 && tick.of[0] == 100000 && tick.of[1] == -100000);
}

// ---- the rig

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
  const Config config = default_config();  // 0.05 rad may be lost
  begin(config);
  Inputs &in = rig.inputs();
  in.flex = 3500;
  in.supply = 500;
  in.switches = 0;
  tick();
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
    begin(default_config(), 1, proven);
    Inputs &in = rig.inputs();
    in.flex = 3500;
    in.supply = 500;
    tick();
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
  begin(config);
  Inputs &in = rig.inputs();
  in.flex = 3500;
  in.supply = 500;
  tick();
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

// ---- session

static Ack send(Session &session, uint8_t code, uint16_t sequence, const void *fields,
                uint8_t size) {
  uint8_t frame[kFrameMaxBytes], answer[Session::kAnswerMaxBytes], got = 0;
  const uint8_t length = encode(code, sequence, fields, size, frame);
  for (uint8_t k = 0; k < length; ++k) got = session.receive(frame[k], answer);
  Ack ack = {0, 255, 0};
  Receiver receiver;
  for (uint8_t k = 0; k < got; ++k)
    if (receiver.take(answer[k]) && receiver.code() == Ack::kCode &&
        receiver.sequence() == sequence)
      memcpy(&ack, receiver.fields(), sizeof ack);
  return ack;
}

static bool is(const Ack &ack, Result result) { return ack.result == static_cast<uint8_t>(result); }

static void commands_are_obeyed_once_and_in_order() {
  healthy();
  Session session(rig, kBuild);
  const Hello wrong = {kDeclaration ^ 1}, hello = {kDeclaration};
  CHECK(is(send(session, Keepalive::kCode, 5, nullptr, 0), Result::out_of_sequence));
  CHECK(is(send(session, Hello::kCode, 65535, &wrong, Hello::kSize), Result::wrong_declaration) &&
        !session.open());
  CHECK(is(send(session, Hello::kCode, 65535, &hello, Hello::kSize), Result::ok) && session.open());
  const Reference here = {100, 0, 0}, there = {200, 0, 0};
  CHECK(is(send(session, Reference::kCode, 0, &here, Reference::kSize), Result::ok));
  CHECK(is(send(session, Reference::kCode, 0, &there, Reference::kSize),
           Result::ok));  // repeated: answered, not done
  Telemetry report;
  rig.report(report);
  CHECK(report.position_1 == 100 && report.flags == 1 << static_cast<uint8_t>(Flag::referenced));
  CHECK(is(send(session, Reference::kCode, 2, &there, Reference::kSize), Result::out_of_sequence));
  CHECK(send(session, Reference::kCode, 65535, &there, Reference::kSize).detail == 1);
  CHECK(is(send(session, Reference::kCode, 1, &there, Reference::kSize - 1), Result::wrong_length));
  CHECK(is(send(session, 99, 1, nullptr, 0), Result::unknown_command));
  const Arm arm = {2};
  CHECK(is(send(session, Arm::kCode, 1, &arm, Arm::kSize), Result::ok));
  CHECK(is(send(session, Hello::kCode, 9, &hello, Hello::kSize), Result::wrong_state));
  CHECK(is(send(session, Stop::kCode, 40000, nullptr, 0), Result::ok) &&
        rig.state() == State::idle);
  CHECK(is(send(session, Stop::kCode, 2, nullptr, 0), Result::ok));
  CHECK(is(send(session, ConfigSave::kCode, 3, nullptr, 0), static_cast<Result>(255)) &&
        session.saving());
  uint8_t frame[kFrameMaxBytes];
  CHECK(session.saved(true, frame) && !session.saving());
  CHECK(is(send(session, ConfigSave::kCode, 3, nullptr, 0), Result::ok) && !session.saving());
}

static void tests() {
  RUN(products_equal_exact_ones);
  RUN(halves_go_up);
  RUN(sums_equal_exact_ones);
  RUN(what_is_not_finite_is_no_number);
  RUN(crc_is_the_published_one);
  RUN(frames_of_all_lengths_come_back);
  RUN(damaged_frames_are_none_and_cost_no_other);
  RUN(four_edges_are_four_counts);
  RUN(deflection_follows_its_polynomial);
  RUN(filtered_velocity_has_its_time_constant);
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
  RUN(steps_come_when_they_are_due);
  RUN(cubic_goes_through_its_knots);
  RUN(a_missing_knot_is_an_underrun);
  RUN(drives_hold_for_their_period_and_end_in_nothing);
  RUN(a_filtered_setpoint_arrives);
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
  RUN(commands_are_obeyed_once_and_in_order);
}
CHECK_MAIN(tests())
