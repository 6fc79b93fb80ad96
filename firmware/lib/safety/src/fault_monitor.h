// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The faults that are looked for while the outputs are on, once a tick.
#pragma once
#include "declaration.h"
#include "quadrature.h"

namespace flexura {

// What moves a joint.
enum class Drive : uint8_t { none, stepper, motor };

// Positions in encoder counts, a motor's drive in PWM counts, a stepper's in microsteps.
struct FaultLimits {
  Drive drive[2];
  int32_t travel_low[2];   // counts
  int32_t travel_high[2];  // counts
  int16_t speed[2];        // counts in kWindow ticks
  // PWM counts. Below it neither stall, runaway nor a broken encoder wire of a motor is judged.
  int16_t stall_duty;
  int16_t stall_speed[2];  // counts / 256 per tick
  uint16_t stall_ticks;
  int32_t runaway[2];    // counts
  int32_t lost;          // microsteps / 256, pulses against encoder
  int32_t against;       // counts of joint 2 against its pulses: wires swapped, not steps lost
  int32_t following[2];  // counts / 256, microsteps / 256
  uint16_t missed;       // edges
  uint16_t alone;        // edges
  uint16_t flex_low;     // readings, from here on
  uint16_t flex_high;
  uint16_t supply_low;
  uint16_t supply_high;
  uint16_t host_ticks;
};

// What the interrupt read from the hardware, since the tick before.
struct Inputs {
  int8_t moved[2];      // counts of the encoders
  uint8_t missed[2];    // edges missed
  uint8_t edges[2][2];  // edges of line A and line B of each encoder
  bool flooded[2];      // an encoder's interrupts had to be shut
  int8_t stepped;       // pulses given
  uint16_t flex;        // reading
  uint16_t supply;      // reading
  uint8_t switches;     // bits of Flag: emergency_stop, limit_low, limit_high
};

struct Measured {
  int32_t position[2];  // counts
  int16_t velocity[2];  // counts / 256 per tick
  int16_t duty[2];      // PWM counts that the motors had in this tick
  int32_t lag;          // microsteps / 256: encoder of joint 2 minus pulses given
  bool tracking;        // the errors below mean something
  int32_t error[2];     // counts / 256, microsteps / 256
};

class FaultMonitor {
 public:
  // Ticks in which a speed is measured: long enough for a coarse encoder.
  static constexpr uint8_t kWindow = 16;

  void start();
  // The first of all faults that hold now, in the order in which they explain each other.
  Fault check(const FaultLimits &limits, const Inputs &in, const Measured &now);
  void host_spoke() { silent_ = 0; }

 private:
  // The joint is known when it compiles: indices cost time on this machine.
  template <uint8_t joint>
  void count_alone(const uint8_t *edges);
  bool steps(int8_t stepped);
  template <uint8_t joint>
  Fault motor(const FaultLimits &limits, const Inputs &in, const Measured &now);
  Fault stepper(const FaultLimits &limits, const Inputs &in, const Measured &now);
  template <uint8_t joint>
  Fault lines(const FaultLimits &limits, const Inputs &in);
  Fault encoders(const FaultLimits &limits, const Inputs &in, const Measured &now);
  template <uint8_t joint>
  Fault bounds(const FaultLimits &limits, const Measured &now);

  uint16_t silent_ = 0;
  uint16_t stalled_[2] = {0, 0};
  uint16_t missed_[2] = {0, 0};
  int32_t against_[2] = {0, 0};  // counts moved against the drive
  int8_t direction_ = 0;         // of the last pulses
  uint8_t since_step_ = 0;       // ticks since the last pulses
  // Edges of one line in a row: a shaft that turns alternates them, a broken wire does not.
  uint16_t alone_[2] = {0, 0};
  EncoderLine alone_line_[2];
  uint8_t flex_out_ = 0;
  uint8_t supply_out_ = 0;
  uint8_t turn_ = 0;
  int16_t travelled_[2] = {0, 0};  // counts in this window
};

// Faults that a switch or a reading means, whatever moves; they forbid arming and clearing too.
Fault standing(const FaultLimits &limits, const Inputs &in);

}  // namespace flexura
