// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Streamed knots, and what they mean in each control tick: cubics between set-points, or drives
// that hold for a period.
//
// Two rings in a row. The host fills the ring of knots. The main loop makes ticks of them, a few
// ahead of time: all the arithmetic and the set-point filter are there. The control interrupt only
// takes the ticks out.
#pragma once
#include "declaration.h"
#include "filter.h"

namespace flexura {

// One knot of both modes: position and velocity of two joints, or a voltage and a rate (then in
// `velocity`).
struct Knot {
  int32_t position[2];  // counts / 256
  int16_t velocity[2];  // counts / 256 per tick; open loop: mV, microsteps/s
};

// What a knot asks for in one tick: set-points [counts / 256], or drives [mV, microsteps/s].
struct Tick {
  int32_t of[2];
};

// Farthest from one knot to the next: 32 bits hold the cubic's terms.
constexpr int32_t kJump = 8191L * 256;

// Ring with one producer and one consumer, each with an index of one byte: neither needs to stop
// the other.
template <class Element, uint8_t kSize>
class Ring {
 public:
  void clear() { head_ = tail_ = 0; }
  uint8_t waiting() const { return static_cast<uint8_t>((head_ - tail_) & (kSize - 1)); }
  uint8_t room() const { return static_cast<uint8_t>(kSize - 1 - waiting()); }
  const Element &first() const { return elements_[tail_]; }
  void put(const Element &element) {
    elements_[head_] = element;
    __asm__ volatile("" ::: "memory");  // it is there before it can be seen
    head_ = static_cast<uint8_t>((head_ + 1) & (kSize - 1));
  }
  void drop() {
    __asm__ volatile("" ::: "memory");  // it was read before it can be overwritten
    tail_ = static_cast<uint8_t>((tail_ + 1) & (kSize - 1));
  }

 private:
  static_assert((kSize & (kSize - 1)) == 0 && kSize <= 128, "a power of two");
  Element elements_[kSize];
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
};

class TrajectoryPlayer {
 public:
  enum class Event : uint8_t { playing, final, underrun };

  // Main loop.
  void clear();
  uint8_t room() const { return knots_.room(); }
  uint8_t waiting() const { return knots_.waiting(); }
  uint16_t next_index() const { return added_; }  // of the knot that add() expects
  bool fresh() const { return fresh_; }           // no knot since it was cleared
  bool closed() const { return closed_; }         // the final knot is there
  const Knot &newest() const { return newest_; }
  const Knot &first() const { return knots_.first(); }
  void add(const Knot &knot, bool final);
  // filter: factors of the two set-points' filters (filter.h).
  void start(uint8_t period_log2, bool cubic, const uint16_t *filter);
  void prepare();  // makes ticks of knots, as many as there is room for

  // Control interrupt, once a tick; `now` keeps its value when nothing is left.
  Event advance(Tick &now) {
    if (ticks_.waiting() == 0) return ended_ ? Event::final : Event::underrun;
    now = ticks_.first();
    ticks_.drop();
    return Event::playing;
  }

 private:
  bool cubic_tick(Tick &tick);
  bool drive_tick(Tick &tick);
  bool load();

  Ring<Knot, kLookaheadKnots> knots_;
  Ring<Tick, 16> ticks_;
  Knot newest_;
  Knot from_;
  uint16_t added_ = 0;
  bool fresh_ = true;
  bool closed_ = false;
  bool cubic_ = false;
  bool begun_ = false;
  bool playing_ = false;
  volatile bool ended_ = false;  // all ticks of a closed trajectory have been made
  uint8_t period_log2_ = 0;
  uint8_t period_ = 1;
  uint8_t tick_ = 0;
  uint16_t s_ = 0;   // tick / period as Q16
  uint16_t ds_ = 0;  // its growth in a tick
  int32_t b_[2][3];  // p = p0 + ((b3 s + b2) s + b1) s
  uint16_t filter_[2] = {0, 0};
  Setpoint setpoint_[2];
};

}  // namespace flexura
