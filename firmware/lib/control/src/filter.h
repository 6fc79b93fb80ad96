// First-order low-pass filters, y += a (x - y) once a tick, a = 1 - exp(-2 pi f T).
#pragma once
#include "fixed.h"

namespace flexura {

// Velocity from the counts of a tick. Q16 inside, so that one count a second is still seen.
class Velocity {
 public:
  void start() { filtered_ = 0; }
  void update(int8_t moved, int16_t filter) {
    filtered_ += fraction(static_cast<int32_t>(moved) * 65536 - filtered_, filter);
  }
  int16_t value() const { return narrow(filtered_ >> 8); }        // counts / 256 per tick

 private:
  int32_t filtered_ = 0;
};

// A set-point and its rate through the same filter. A filter of 0 lets both pass.
class Setpoint {
 public:
  void start(int32_t position) { position_ = position, rate_ = 0; }
  void update(int32_t position, int16_t rate, int16_t filter) {
    if (filter == 0) {
      position_ = position, rate_ = static_cast<int32_t>(rate) * 256;
    } else {
      position_ = add(position_, fraction(subtract(position, position_), filter));
      rate_ += fraction(static_cast<int32_t>(rate) * 256 - rate_, filter);
    }
  }
  int32_t position() const { return position_; }                  // counts / 256
  int16_t rate() const { return static_cast<int16_t>(rate_ >> 8); }  // counts / 256 per tick

 private:
  int32_t position_ = 0, rate_ = 0;
};

}  // namespace flexura
