// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "motor.h"

#include "declaration.h"
#include "pin.h"

namespace motor {

using Timer = pin::motor_timer;

namespace {
// Bits of the same place in the 16-bit timers 1, 3 and 4. Mode 14: fast PWM up to ICRn; a new
// OCRnx holds from the next period on.
constexpr uint8_t kModeA = _BV(WGM41);
constexpr uint8_t kModeB = _BV(WGM43) | _BV(WGM42) | _BV(CS40);

void connect(uint8_t output) {
  const uint8_t mode = kModeA | output;
  if (Timer::control_a() == mode) return;
  Timer::control_a() = mode;
  pin::set_low<pin::motor_forward>();
  pin::set_low<pin::motor_reverse>();
}
}  // namespace

void begin() {
  pin::begin_output<pin::motor_enable>();
  pin::begin_output<pin::motor_forward>();
  pin::begin_output<pin::motor_reverse>();
  Timer::control_a() = kModeA;
  Timer::control_b() = kModeB;
  Timer::top() = flexura::kDutyFull - 1;
}

// A line at rest is disconnected: a compare value of 0 would still give one count of every period.
void drive(int16_t duty) {
  if (duty > 0) {
    pin::motor_forward::compare() = static_cast<uint16_t>(duty - 1);
    connect(pin::motor_forward::connected);
  } else if (duty < 0) {
    pin::motor_reverse::compare() = static_cast<uint16_t>(-duty - 1);
    connect(pin::motor_reverse::connected);
  } else {
    connect(0);
  }
}

void enable(bool on) { pin::set<pin::motor_enable>(on); }

bool enabled() { return pin::motor_enable::port() & pin::motor_enable::mask; }

}  // namespace motor
