// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "fault_monitor.h"

namespace flexura {

namespace {
constexpr uint8_t kReadings = 4;  // out of range this many ticks in a row: noise is not a fault
constexpr uint8_t kEcho = 50;     // ticks in which a shaft answers a pulse

bool is_set(uint8_t bits, Flag flag) { return bits >> static_cast<uint8_t>(flag) & 1; }

bool beyond(int32_t value, int32_t limit) { return value > limit || value < -limit; }

Fault switches(uint8_t bits) {
  if (is_set(bits, Flag::emergency_stop)) return Fault::emergency_stop;
  if (is_set(bits, Flag::limit_low)) return Fault::limit_low;
  if (is_set(bits, Flag::limit_high)) return Fault::limit_high;
  return Fault::none;
}

Fault supply(const FaultLimits &limits, uint16_t reading) {
  return reading < limits.supply_low    ? Fault::supply_low
         : reading > limits.supply_high ? Fault::supply_high
                                        : Fault::none;
}

Fault flex(const FaultLimits &limits, uint16_t reading) {
  return reading < limits.flex_low    ? Fault::flex_low
         : reading > limits.flex_high ? Fault::flex_high
                                      : Fault::none;
}

// Counts moved against a drive of this sign, forgotten as far as the joint moves with it again.
int32_t against(int32_t before, int8_t drive, int8_t moved) {
  if (drive == 0) return before;
  const int32_t sum = before + (drive > 0 ? -moved : moved);
  return sum < 0 ? 0 : sum;
}
}  // namespace

Fault standing(const FaultLimits &limits, const Inputs &in) {
  Fault fault = switches(in.switches);
  if (fault == Fault::none) fault = supply(limits, in.supply);
  if (fault == Fault::none) fault = flex(limits, in.flex);
  return fault;
}

void FaultMonitor::start() {
  silent_ = 0;
  direction_ = 0;
  since_step_ = kEcho + 1;
  flex_out_ = 0;
  supply_out_ = 0;
  turn_ = 0;
  for (uint8_t j = 0; j < 2; ++j) {
    missed_[j] = 0;
    alone_[j] = 0;
    against_[j] = 0;
    stalled_[j] = 0;
    travelled_[j] = 0;
  }
}

template <uint8_t j>
void FaultMonitor::count_alone(const uint8_t *edges) {
  const uint8_t a = edges[0];
  const uint8_t b = edges[1];
  if (!a && !b) return;
  const EncoderLine line = a ? EncoderLine::a : EncoderLine::b;
  if ((a && b) || line != alone_line_[j]) alone_[j] = 0;
  alone_line_[j] = line;
  if (!(a && b)) alone_[j] = static_cast<uint16_t>(alone_[j] + a + b);
}

// Whether joint 2 is given pulses, or was a moment ago. One that turns back crosses the same edge
// again, which is no sign of a broken wire.
bool FaultMonitor::steps(int8_t stepped) {
  if (stepped) {
    const int8_t direction = stepped > 0 ? 1 : -1;
    if (direction != direction_) alone_[1] = 0;
    direction_ = direction;
    since_step_ = 0;
  } else if (since_step_ <= kEcho) {
    ++since_step_;
  }
  return since_step_ <= kEcho;
}

// A motor and its encoder.
template <uint8_t j>
Fault FaultMonitor::motor(const FaultLimits &limits, const Inputs &in, const Measured &now) {
  const int16_t duty = now.duty[j];
  const bool driven = duty > limits.stall_duty || duty < -limits.stall_duty;
  // A shaft that nothing drives may rest on an edge and tremble, for as long as it likes.
  if (!driven) {
    alone_[j] = 0;
    against_[j] = 0;
    stalled_[j] = 0;
    return Fault::none;
  }
  count_alone<j>(in.edges[j]);
  if (alone_[j] >= limits.alone) return j ? Fault::encoder_2 : Fault::encoder_1;
  against_[j] = against(against_[j], duty > 0 ? 1 : -1, in.moved[j]);
  if (against_[j] > limits.runaway[j]) return j ? Fault::runaway_2 : Fault::runaway_1;
  stalled_[j] =
      beyond(now.velocity[j], limits.stall_speed[j]) ? 0 : static_cast<uint16_t>(stalled_[j] + 1);
  if (stalled_[j] >= limits.stall_ticks) return j ? Fault::stall_2 : Fault::stall_1;
  return Fault::none;
}

// The stepper of joint 2 and its encoder.
Fault FaultMonitor::stepper(const FaultLimits &limits, const Inputs &in, const Measured &now) {
  if (steps(in.stepped)) count_alone<1>(in.edges[1]);
  if (alone_[1] >= limits.alone) return Fault::encoder_2;
  against_[1] = against(against_[1], direction_, in.moved[1]);
  if (!beyond(now.lag, limits.lost)) return Fault::none;
  // Why: the encoder went the other way for a good part of it; or only one of its lines moves; or
  // the motor did not follow.
  if (against_[1] > limits.against) return Fault::runaway_2;
  return alone_[1] >= 4 ? Fault::encoder_2 : Fault::stall_2;
}

template <uint8_t j>
Fault FaultMonitor::lines(const FaultLimits &limits, const Inputs &in) {
  if (!in.missed[j] && !in.flooded[j]) return Fault::none;
  missed_[j] = static_cast<uint16_t>(missed_[j] + in.missed[j]);
  const bool broken = in.flooded[j] || missed_[j] > limits.missed;
  return !broken ? Fault::none : j ? Fault::encoder_2 : Fault::encoder_1;
}

Fault FaultMonitor::encoders(const FaultLimits &limits, const Inputs &in, const Measured &now) {
  Fault fault = lines<0>(limits, in);
  if (fault == Fault::none) fault = lines<1>(limits, in);
  if (fault == Fault::none && limits.drive[0] == Drive::motor) fault = motor<0>(limits, in, now);
  if (fault != Fault::none || limits.drive[1] == Drive::none) return fault;
  return limits.drive[1] == Drive::motor ? motor<1>(limits, in, now) : stepper(limits, in, now);
}

template <uint8_t j>
Fault FaultMonitor::bounds(const FaultLimits &limits, const Measured &now) {
  if (now.position[j] < limits.travel_low[j] || now.position[j] > limits.travel_high[j])
    return j ? Fault::travel_2 : Fault::travel_1;
  if (now.tracking && beyond(now.error[j], limits.following[j]))
    return j ? Fault::following_2 : Fault::following_1;
  if (turn_ % kWindow != j) return Fault::none;
  const int16_t way = travelled_[j];
  travelled_[j] = 0;
  if (way <= limits.speed[j] && way >= -limits.speed[j]) return Fault::none;
  return j ? Fault::speed_2 : Fault::speed_1;
}

Fault FaultMonitor::check(const FaultLimits &limits, const Inputs &in, const Measured &now) {
  Fault fault = switches(in.switches);
  if (fault != Fault::none) return fault;

  fault = supply(limits, in.supply);
  supply_out_ = fault == Fault::none ? 0 : static_cast<uint8_t>(supply_out_ + 1);
  if (supply_out_ >= kReadings) return fault;

  fault = encoders(limits, in, now);
  if (fault != Fault::none) return fault;

  // One joint in each tick: time is short, and what they watch takes longer than two.
  turn_ = static_cast<uint8_t>((turn_ + 1) % (2 * kWindow));
  travelled_[0] = static_cast<int16_t>(travelled_[0] + in.moved[0]);
  travelled_[1] = static_cast<int16_t>(travelled_[1] + in.moved[1]);
  fault = turn_ & 1 ? bounds<1>(limits, now) : bounds<0>(limits, now);
  if (fault != Fault::none) return fault;

  fault = flex(limits, in.flex);
  flex_out_ = fault == Fault::none ? 0 : static_cast<uint8_t>(flex_out_ + 1);
  if (flex_out_ >= kReadings) return fault;

  if (++silent_ > limits.host_ticks) return Fault::host_silent;
  return Fault::none;
}

}  // namespace flexura
