// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Step pulses, and trajectories from knots and drives.
#include <math.h>

#include "bench.h"
#include "random.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

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

static void tests() {
  RUN(steps_come_when_they_are_due);
  RUN(cubic_goes_through_its_knots);
  RUN(a_missing_knot_is_an_underrun);
  RUN(drives_hold_for_their_period_and_end_in_nothing);
  RUN(a_filtered_setpoint_arrives);
}
CHECK_MAIN(tests())
