// The look-ahead of streamed knots, and their playing: cubics between set-points, or drives that hold for a period.
#pragma once
#include "declaration.h"

namespace flexura {

// One knot of both modes: position and velocity of two joints, or a voltage and a rate (then in `velocity`).
struct Knot {
  int32_t position[2];   // counts / 256
  int16_t velocity[2];   // counts / 256 per tick; open loop: mV, microsteps/s
};

constexpr int32_t kJump = 8191L * 256;   // farthest from one knot to the next: 32 bits hold the cubic's terms

// One producer (the main loop: add) and one consumer (the control interrupt: advance), each with an index of one byte.
class Player {
 public:
  enum class Event : uint8_t { playing, final, underrun };

  void clear() { head_ = tail_ = 0, added_ = 0, closed_ = false, fresh_ = true; }
  uint8_t room() const { return static_cast<uint8_t>(kLookaheadKnots - 1 - waiting()); }
  uint8_t waiting() const { return static_cast<uint8_t>((head_ - tail_) & (kLookaheadKnots - 1)); }
  uint16_t next_index() const { return added_; }           // of the knot that add() expects
  bool fresh() const { return fresh_; }                    // no knot since it was cleared
  bool closed() const { return closed_; }                  // the final knot is there
  const Knot &newest() const { return newest_; }
  const Knot &first() const { return ring_[tail_]; }       // of those waiting
  void add(const Knot &knot, bool final);

  void start(uint8_t period_log2, bool cubic);
  Event advance();                                         // once a tick

  const int32_t *position() const { return position_; }    // cubic mode: counts / 256
  const int16_t *velocity() const { return velocity_; }    // cubic mode: the change in this tick; open loop: the drives

 private:
  bool load();

  static_assert((kLookaheadKnots & (kLookaheadKnots - 1)) == 0 && kLookaheadKnots <= 128, "a power of two");
  Knot ring_[kLookaheadKnots], newest_, from_;
  volatile uint8_t head_ = 0, tail_ = 0;
  uint16_t added_ = 0;
  volatile bool closed_ = false;
  bool fresh_ = true, cubic_ = false, done_ = false;
  uint8_t period_log2_ = 0, tick_ = 0;
  int32_t b_[2][3];                                        // p = p0 + ((b3 s + b2) s + b1) s, s = tick / period
  int32_t position_[2] = {0, 0};
  int16_t velocity_[2] = {0, 0};
};

}  // namespace flexura
