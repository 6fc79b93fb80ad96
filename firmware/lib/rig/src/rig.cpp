// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What happens in a control tick: sense, play the trajectory, look for faults, control.
#include "rig.h"

namespace flexura {

namespace {
// Q16, units of u_2 (1/4096 microstep per tick) in 1 microstep/s.
constexpr int32_t kRateOfStep = 268435;
constexpr uint8_t kPressTicks = 50;  // a person presses for longer, a disturbance does not

bool is_set(uint8_t bits, Flag flag) { return bits >> static_cast<uint8_t>(flag) & 1; }

bool is_set(uint8_t bits, Reset cause) { return bits >> static_cast<uint8_t>(cause) & 1; }
}  // namespace

void Rig::begin(const Stored *stored, uint8_t reset, uint32_t firmware, uint8_t motors) {
  firmware_ = firmware;
  motors_ = motors;
  proven_ = stored ? stored->proven : 0;
  config_ = stored ? stored->config : default_config();
  wrong_item_ = convert(fixed_);
  stored_ = stored && wrong_item_ == kAllValid;
  if (!stored_) {
    config_ = default_config();
    wrong_item_ = convert(fixed_);
  }
  if (is_set(reset, Reset::watchdog)) trip(Fault::watchdog);
  if (is_set(reset, Reset::brown_out) && !is_set(reset, Reset::power_on)) trip(Fault::brown_out);
  if (!stored_) trip(Fault::bad_configuration);
}

// The watchdog's interrupt may come at any time: a reason is not replaced half-way.
void Rig::trip(Fault fault) {
  InterruptLock lock;
  if (state_ == State::fault) return;
  fault_ = fault;
  fault_tick_ = tick_;
  state_ = State::fault;
}

// Without an encoder at joint 2 nobody reads its lines, and a stepper's pulses are its position.
void Rig::replace_encoder_2() {
  in_.moved[1] = drive(1) == Drive::stepper ? in_.stepped : 0;
  in_.missed[1] = 0;
  in_.edges[1][0] = in_.edges[1][1] = 0;
  in_.flooded[1] = false;
}

void Rig::sense() {
  if (!fixed_.encoder_2) replace_encoder_2();
  for (uint8_t j = 0; j < 2; ++j) {
    measured_.position[j] += in_.moved[j];
    if (drive(j) == Drive::motor || fixed_.on_encoder) {  // else the control does not need it
      velocity_[j].update(in_.moved[j], fixed_.velocity_filter);
      measured_.velocity[j] = velocity_[j].value();
    }
    if (in_.missed[j]) missed_ = static_cast<uint16_t>(missed_ + in_.missed[j]);
  }
  // Nobody judges encoders while the outputs are off; where the joints are is not known any more.
  if (!active() && (in_.missed[0] || in_.missed[1] || in_.flooded[0] || in_.flooded[1]))
    referenced_ = false;
  if (drive(1) == Drive::stepper) {
    steps_given_ += in_.stepped;
    const int32_t rest = by_encoder_rest_ + fixed_.ratio * in_.moved[1];
    by_encoder_ += upper(rest);
    by_encoder_rest_ = lower(rest);
    measured_.lag = to_q8(by_encoder_ - steps_given_) + (by_encoder_rest_ >> 8);
  }
  // The strip's slowness allows two ticks a reading, and noise asks for them.
  if (tick_ & 1) {
    flex_before_ = in_.flex;
  } else {
    flex_sensor_.update(fixed_.tip, static_cast<uint16_t>(flex_before_ + in_.flex));
  }
}

// Seen with the outputs off: the emergency stop open for long enough, then closed.
void Rig::watch_stop() {
  const bool open = is_set(in_.switches, Flag::emergency_stop);
  if (!open) {
    stop_open_ = 0;
    if (stop_trial_ == StopTrial::pressed) stop_trial_ = StopTrial::released;
  } else if (++stop_open_ >= kPressTicks) {
    stop_open_ = kPressTicks;
    stop_trial_ = StopTrial::pressed;
  }
}

// Set-points and positions lie within half of what 32 bits hold (fixed_point_config.cpp,
// commands.cpp), so that their differences fit.
int32_t Rig::error(uint8_t joint) const {
  const int32_t position = drive(joint) != Drive::stepper ? to_q8(measured_.position[joint])
                           : fixed_.on_encoder ? to_q8(by_encoder_) + (by_encoder_rest_ >> 8)
                                               : step_generator_.position();
  return static_cast<int32_t>(static_cast<uint32_t>(target_.of[joint]) -
                              static_cast<uint32_t>(position));
}

void Rig::tick(Outputs &out) {
  {
    InterruptLock lock;  // the watchdog's interrupt may read it
    tick_ = tick_ + 1;
  }
  sense();
  out.steps.count = 0;
  measured_.tracking = false;
  if (state_ == State::running) {
    const Tick before = target_;
    const TrajectoryPlayer::Event event = player_.advance(target_);
    if (event == TrajectoryPlayer::Event::underrun) trip(Fault::underrun);
    final_ = event == TrajectoryPlayer::Event::final;
    if (mode_ == Mode::position) {
      measured_.tracking = true;
      for (uint8_t j = 0; j < 2; ++j) {
        setpoint_rate_[j] = saturate16(target_.of[j] - before.of[j]);
        measured_.error[j] = error(j);
      }
    }
  }
  if (active()) {
    const Fault fault = monitor_.check(fixed_.limits, in_, measured_);
    if (fault != Fault::none) trip(fault);
  }
  if (active()) {
    control();
    out.on = true;
    if (drive(1) == Drive::stepper) step_generator_.plan(pid_[1].output(), out.steps);
  } else {
    watch_stop();
    out.on = false;
    measured_.duty[0] = measured_.duty[1] = 0;
  }
  for (uint8_t j = 0; j < 2; ++j) out.duty[j] = measured_.duty[j];
}

// What a knot's drive asks for, in units of u.
int32_t Rig::open_loop(uint8_t joint) const {
  const int16_t asked = static_cast<int16_t>(target_.of[joint]);
  return drive(joint) == Drive::stepper ? multiply_high(kRateOfStep, asked)
                                        : nearest(multiply(fixed_.duty, asked));
}

void Rig::control() {
  const PidGains *gains = fixed_.gains;
  if (state_ == State::armed) {
    pid_[0].start(0);
    if (drive(1) == Drive::stepper) {
      pid_[1].track(gains[1], 0);  // it brakes
    } else {
      pid_[1].start(0);
    }
  } else if (mode_ == Mode::open_loop) {
    for (uint8_t j = 0; j < 2; ++j) pid_[j].track(gains[j], open_loop(j));
  } else {
    // The deflection is new in every second tick. Joint 1 takes it at once, joint 2 in the next
    // tick: the products are shared between the two.
    const uint8_t turn = tick_ & 1;
    added_[turn] = added_terms(gains[turn], flex_sensor_.deflection(), flex_sensor_.rate(),
                               disturbance_[turn]);
    // The observers take turns too, each while the other joint has its products.
    if (turn == 1)
      disturbance_[0] =
          observer_[0].update(fixed_.observer[0], pid_[0].output(), measured_.velocity[0]);
    else if (drive(1) == Drive::motor)
      disturbance_[1] =
          observer_[1].update(fixed_.observer[1], pid_[1].output(), measured_.velocity[1]);
    PidSignals signals = {measured_.error[0], measured_.velocity[0], setpoint_rate_[0], added_[0]};
    pid_[0].update(gains[0], signals);
    signals.error = measured_.error[1];
    signals.added = added_[1];
    signals.setpoint_rate = setpoint_rate_[1];
    signals.rate = drive(1) == Drive::motor ? measured_.velocity[1]
                   : fixed_.on_encoder      ? upper(multiply(fixed_.ratio, measured_.velocity[1]))
                                            : static_cast<int16_t>(pid_[1].output() >> 4);
    if (drive(1) != Drive::none) pid_[1].update(gains[1], signals);
  }
  for (uint8_t j = 0; j < 2; ++j)
    measured_.duty[j] =
        drive(j) == Drive::motor ? static_cast<int16_t>((pid_[j].output() + 8) >> 4) : int16_t(0);
}

uint32_t Rig::now() const {
  CriticalSection section;
  return tick_;
}

void Rig::report(Telemetry &report) const {
  int16_t output[2];
  bool on;
  {
    CriticalSection section;  // copies only: the control interrupt waits
    {
      InterruptLock lock;  // the watchdog's interrupt may trip
      report.tick = tick_;
      report.state = static_cast<uint8_t>(state_);
      report.fault = static_cast<uint8_t>(fault_);
      report.fault_tick = fault_tick_;
      on = active();
    }
    report.flags = in_.switches;
    report.position_1 = measured_.position[0];
    report.position_2 = measured_.position[1];
    report.steps = steps_given_;
    report.setpoint_1 = target_.of[0];
    report.setpoint_2 = target_.of[1];
    report.flex = in_.flex;
    report.supply = in_.supply;
    report.missed = missed_;
    for (uint8_t j = 0; j < 2; ++j) output[j] = on ? pid_[j].output() : 0;
  }
  int16_t voltage[2];
  bool saturated = false;
  for (uint8_t j = 0; j < 2; ++j) {
    const bool motor = drive(j) == Drive::motor;
    const int16_t limit = fixed_.gains[j].limit;
    voltage[j] = motor ? nearest(multiply(fixed_.voltage, output[j])) : int16_t(0);
    saturated = saturated || (on && motor && (output[j] >= limit || output[j] <= -limit));
  }
  const bool steps = drive(1) == Drive::stepper;
  const bool holds = final_ && report.state == static_cast<uint8_t>(State::running);
  // From bridge_enabled on, in the order of Flag.
  const bool bits[] = {on, on && steps, referenced_, holds, saturated};
  for (uint8_t k = 0; k < sizeof bits; ++k)
    if (bits[k])
      report.flags = static_cast<uint8_t>(report.flags |
                                          1 << (static_cast<uint8_t>(Flag::bridge_enabled) + k));
  report.buffered = player_.waiting();
  report.voltage = voltage[0];
  report.voltage_2 = voltage[1];
  report.rate = steps ? static_cast<int16_t>(output[1] * 1000L / 4096) : 0;
  report.supply = static_cast<uint16_t>(static_cast<uint32_t>(report.supply) * fixed_.supply >> 6);
}

void Rig::host_spoke() {
  CriticalSection section;
  monitor_.host_spoke();
}

}  // namespace flexura
