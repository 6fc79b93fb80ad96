// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "trajectory_player.h"

namespace flexura {

namespace {
int32_t over_period(int16_t velocity, uint8_t period_log2) {
  return static_cast<int32_t>(static_cast<uint32_t>(static_cast<int32_t>(velocity)) << period_log2);
}
}  // namespace

void TrajectoryPlayer::clear() {
  knots_.clear();
  ticks_.clear();
  added_ = 0;
  fresh_ = true;
  closed_ = false;
  begun_ = false;
  playing_ = false;
  ended_ = false;
}

void TrajectoryPlayer::add(const Knot &knot, bool final) {
  newest_ = knot;
  knots_.put(knot);
  ++added_;
  fresh_ = false;
  closed_ = final;
}

void TrajectoryPlayer::start(uint8_t period_log2, bool cubic, const uint16_t *filter) {
  period_log2_ = period_log2;
  period_ = static_cast<uint8_t>(1 << period_log2);
  cubic_ = cubic;
  tick_ = 0;
  ds_ = static_cast<uint16_t>(65536UL >> period_log2);  // never used where a period is one tick
  s_ = ds_;
  from_ = knots_.first();
  knots_.drop();
  for (uint8_t j = 0; j < 2; ++j) {
    filter_[j] = filter[j];
    setpoint_[j].start(from_.position[j]);
  }
  if (cubic && !load()) tick_ = period_;  // the first knot is the final one
  playing_ = true;
  begun_ = true;
  prepare();
}

void TrajectoryPlayer::prepare() {
  Tick tick;
  while (playing_ && ticks_.room() && (cubic_ ? cubic_tick(tick) : drive_tick(tick)))
    ticks_.put(tick);
  if (begun_ && !playing_) ended_ = true;
}

// Hermite's cubic from the last knot to the next, multiplied out; false when there is none.
bool TrajectoryPlayer::load() {
  if (knots_.waiting() == 0) return false;
  const Knot &to = knots_.first();
  for (uint8_t j = 0; j < 2; ++j) {
    const int32_t way = to.position[j] - from_.position[j];
    const int32_t v0 = over_period(from_.velocity[j], period_log2_);
    const int32_t v1 = over_period(to.velocity[j], period_log2_);
    b_[j][0] = v0;
    b_[j][1] = 3 * way - 2 * v0 - v1;
    b_[j][2] = v0 + v1 - 2 * way;
  }
  return true;
}

// False when the next knot is missing.
bool TrajectoryPlayer::drive_tick(Tick &tick) {
  if (tick_ == period_) {
    if (knots_.waiting() == 0 && !closed_) return false;
    if (knots_.waiting() == 0) {
      tick = {{0, 0}};
      playing_ = false;
      return true;
    }
    from_ = knots_.first();
    knots_.drop();
    tick_ = 0;
  }
  ++tick_;
  tick = {{from_.velocity[0], from_.velocity[1]}};
  return true;
}

bool TrajectoryPlayer::cubic_tick(Tick &tick) {
  const bool last = tick_ == period_ && !load();
  if (last && !closed_) return false;
  int32_t position[2] = {from_.position[0], from_.position[1]};
  if (!last) {
    if (tick_ == period_) {
      tick_ = 0;
      s_ = ds_;
    }
    if (++tick_ < period_) {
      for (uint8_t j = 0; j < 2; ++j) {
        const int32_t *b = b_[j];
        position[j] += multiply_q16(multiply_q16(multiply_q16(b[2], s_) + b[1], s_) + b[0], s_);
      }
      s_ = static_cast<uint16_t>(s_ + ds_);
    } else {
      from_ = knots_.first();
      knots_.drop();
      position[0] = from_.position[0];
      position[1] = from_.position[1];
    }
  }
  bool rest = last;
  for (uint8_t j = 0; j < 2; ++j) {
    const int32_t before = setpoint_[j].position();
    tick.of[j] = setpoint_[j].update(position[j], filter_[j]);
    rest = rest && tick.of[j] == before;
  }
  if (rest) {  // the filters too have arrived, but for their rounding
    tick = {{position[0], position[1]}};
    playing_ = false;
  }
  return true;
}

}  // namespace flexura
