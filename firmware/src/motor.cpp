// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "motor.h"

#include "declaration.h"
#include "pin.h"

namespace {

// Bits of the same place in the 16-bit timers 1, 3 and 4. Mode 14: fast PWM up to ICRn; a new
// OCRnx holds from the next period on.
constexpr uint8_t kModeA = _BV(WGM41);
constexpr uint8_t kModeB = _BV(WGM43) | _BV(WGM42) | _BV(CS40);

// A bridge on three pins and the timer of two of them.
template <class Forward, class Reverse, class Enable, class Timer>
struct Bridge {
  static void begin() {
    pin::begin_output<Enable>();
    pin::begin_output<Forward>();
    pin::begin_output<Reverse>();
    Timer::control_a() = kModeA;
    Timer::control_b() = kModeB;
    Timer::top() = flexura::kDutyFull - 1;
  }

  // A line at rest is disconnected: a compare value of 0 would still give one count of every
  // period.
  static void drive(int16_t duty) {
    if (duty > 0) {
      Forward::compare() = static_cast<uint16_t>(duty - 1);
      connect(Forward::connected);
    } else if (duty < 0) {
      Reverse::compare() = static_cast<uint16_t>(-duty - 1);
      connect(Reverse::connected);
    } else {
      connect(0);
    }
  }

  static void enable(bool on) { pin::set<Enable>(on); }
  static bool enabled() { return Enable::port() & Enable::mask; }

 private:
  static void connect(uint8_t output) {
    const uint8_t mode = kModeA | output;
    if (Timer::control_a() == mode) return;
    Timer::control_a() = mode;
    pin::set_low<Forward>();
    pin::set_low<Reverse>();
  }
};

using First = Bridge<pin::motor_forward, pin::motor_reverse, pin::motor_enable, pin::motor_timer>;

#if FLEXURA_MOTORS > 1
using Second =
    Bridge<pin::motor_2_forward, pin::motor_2_reverse, pin::motor_2_enable, pin::motor_2_timer>;
#else
struct Second {
  static void begin() {}
  static void drive(int16_t) {}
  static void enable(bool) {}
  static bool enabled() { return false; }
};
#endif

}  // namespace

namespace motor {

void begin() {
  First::begin();
  Second::begin();
}

void drive(const int16_t duty[2]) {
  First::drive(duty[0]);
  Second::drive(duty[1]);
}

void enable(bool first, bool second) {
  First::enable(first);
  Second::enable(second);
}

bool enabled() { return First::enabled() || Second::enabled(); }

}  // namespace motor
