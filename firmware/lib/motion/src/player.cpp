#include "player.h"

#include "fixed.h"

namespace flexura {

namespace {
int32_t over_period(int16_t velocity, uint8_t period_log2) {
  return static_cast<int32_t>(static_cast<uint32_t>(static_cast<int32_t>(velocity)) << period_log2);
}
}  // namespace

void Player::add(const Knot &knot, bool final) {
  ring_[head_] = newest_ = knot;
  ++added_;
  fresh_ = false;
  if (final) closed_ = true;
  __asm__ volatile("" ::: "memory");                                   // all of it is there before it can be seen
  head_ = static_cast<uint8_t>((head_ + 1) & (kLookaheadKnots - 1));
}

void Player::start(uint8_t period_log2, bool cubic) {
  period_log2_ = period_log2;
  cubic_ = cubic;
  tick_ = 0;
  done_ = false;
  from_ = ring_[tail_];
  tail_ = static_cast<uint8_t>((tail_ + 1) & (kLookaheadKnots - 1));
  for (uint8_t j = 0; j < 2; ++j) {
    position_[j] = from_.position[j];
    velocity_[j] = cubic ? 0 : from_.velocity[j];
  }
  if (cubic && !load()) done_ = true;
}

// Hermite's cubic from the last knot to the next, multiplied out; false when there is none.
bool Player::load() {
  if (waiting() == 0) return false;
  const Knot &to = ring_[tail_];
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

Player::Event Player::advance() {
  if (done_) {
    velocity_[0] = velocity_[1] = 0;
    return Event::final;
  }
  ++tick_;
  const bool knot = tick_ >> period_log2_;
  if (!cubic_) {
    if (!knot) return Event::playing;
    tick_ = 0;
    if (waiting() == 0) {
      velocity_[0] = velocity_[1] = 0;
      done_ = closed_;
      return closed_ ? Event::final : Event::underrun;
    }
    from_ = ring_[tail_];
    tail_ = static_cast<uint8_t>((tail_ + 1) & (kLookaheadKnots - 1));
    velocity_[0] = from_.velocity[0], velocity_[1] = from_.velocity[1];
    return Event::playing;
  }
  for (uint8_t j = 0; j < 2; ++j) {
    const int32_t *b = b_[j], s = tick_;
    const int32_t moved = ((((b[2] * s >> period_log2_) + b[1]) * s >> period_log2_) + b[0]) * s >> period_log2_;
    const int32_t position = from_.position[j] + moved;
    velocity_[j] = narrow(position - position_[j]);
    position_[j] = position;
  }
  if (!knot) return Event::playing;
  tick_ = 0;
  from_ = ring_[tail_];
  tail_ = static_cast<uint8_t>((tail_ + 1) & (kLookaheadKnots - 1));
  if (load()) return Event::playing;
  // The last knot was reached: it is held, or the next one is missing.
  done_ = closed_;
  return closed_ ? Event::final : Event::underrun;
}

}  // namespace flexura
