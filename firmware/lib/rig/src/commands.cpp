// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the host may ask for, and when: one handler a command.
#include <string.h>

#include "rig.h"

namespace flexura {

namespace {
constexpr int32_t kFarthest = 1L << 22;  // counts, microsteps: as Q8 half of what 31 bits hold
bool near(int32_t value) { return value < kFarthest && value > -kFarthest; }

// After these faults the position of the joint is unknown.
bool loses_position(Fault fault) {
  return fault == Fault::encoder_1 || fault == Fault::encoder_2 || fault == Fault::stall_2 ||
         fault == Fault::runaway_1 || fault == Fault::runaway_2;
}
}  // namespace

struct Rig::Handler {
  uint8_t code;
  Result (*handle)(Rig &rig, const uint8_t *fields, uint16_t &detail);
};

template <class Message>
Result Rig::handle_fields(Rig &rig, const uint8_t *fields, uint16_t &detail) {
  Message command;
  if (sizeof(Message) == Message::kSize) memcpy(&command, fields, Message::kSize);
  return rig.handle(command, detail);
}

#define FLEXURA_ROW(Message) {Message::kCode, &Rig::handle_fields<Message>},
const Rig::Handler Rig::kHandlers[] = {FLEXURA_RIG_COMMANDS(FLEXURA_ROW)};
#undef FLEXURA_ROW

Result Rig::command(uint8_t code, const uint8_t *fields, uint16_t &detail) {
  detail = static_cast<uint16_t>(state_);
  for (const Handler &handler : kHandlers)
    if (handler.code == code) return handler.handle(*this, fields, detail);
  return Result::unknown_command;
}

bool Rig::enter(State from, State to) {
  InterruptLock lock;
  if (state_ != from) return false;
  state_ = to;
  return true;
}

Result Rig::handle(const Keepalive &, uint16_t &) { return Result::ok; }

Result Rig::handle(const Stop &, uint16_t &) {
  CriticalSection section;
  if (!enter(State::armed, State::idle)) enter(State::running, State::idle);
  player_.clear();
  return Result::ok;
}

Result Rig::handle(const Reference &command, uint16_t &) {
  if (state_ != State::idle) return Result::wrong_state;
  if (!near(command.position_1) || !near(command.position_2) || !near(command.steps))
    return Result::out_of_range;
  if (drive(1) != Drive::stepper && command.steps != 0) return Result::out_of_range;
  if (drive(1) == Drive::none && command.position_2 != 0) return Result::out_of_range;
  // Where the encoder says a stepper is, in microsteps; the pulses must agree with it.
  const int64_t exact = static_cast<int64_t>(fixed_.ratio) * command.position_2;
  const int64_t lag = (exact >> 8) - static_cast<int64_t>(command.steps) * 256;
  if (drive(1) == Drive::stepper && (lag > fixed_.limits.lost || lag < -fixed_.limits.lost))
    return Result::out_of_range;
  CriticalSection section;
  measured_.position[0] = command.position_1;
  measured_.position[1] = command.position_2;
  steps_given_ = command.steps;
  by_encoder_ = static_cast<int32_t>(exact >> 16);
  by_encoder_rest_ = static_cast<uint16_t>(exact);
  referenced_ = true;
  return Result::ok;
}

Result Rig::handle(const Arm &command, uint16_t &detail) {
  if (state_ != State::idle) return Result::wrong_state;
  if (command.mode != static_cast<uint8_t>(Mode::open_loop) &&
      command.mode != static_cast<uint8_t>(Mode::position))
    return Result::out_of_range;
  if (wrong_item_ != kAllValid) {
    detail = wrong_item_;
    return Result::inconsistent;
  }
  if (proven_ != firmware_ || firmware_ == 0) {
    detail = static_cast<uint16_t>(stop_trial_);
    return Result::stop_unproven;
  }
  CriticalSection section;
  if (!referenced_) return Result::not_referenced;
  const Fault fault = standing(fixed_.limits, in_);
  if (fault != Fault::none) {
    detail = static_cast<uint16_t>(fault);
    return Result::fault_persists;
  }
  player_.clear();
  monitor_.start();
  step_generator_.start(steps_given_);
  flex_sensor_.start(fixed_.tip, static_cast<uint16_t>(2 * in_.flex));
  for (uint8_t j = 0; j < 2; ++j) {
    velocity_[j].start();
    pid_[j].start(0);
    observer_[j].start();
    added_[j] = disturbance_[j] = 0;
  }
  target_ = {{0, 0}};
  mode_ = static_cast<Mode>(command.mode);
  return enter(State::idle, State::armed) ? Result::ok : Result::wrong_state;
}

Result Rig::handle(const Commission &, uint16_t &detail) {
  if (state_ != State::idle) return Result::wrong_state;
  if (stop_trial_ != StopTrial::released) {
    detail = static_cast<uint16_t>(stop_trial_);
    return Result::stop_unproven;
  }
  proven_ = firmware_;
  return Result::ok;
}

Result Rig::may_add(uint16_t first, uint8_t count, uint8_t most, uint16_t &detail) const {
  if (!active() || player_.closed()) return Result::wrong_state;
  if (count < 1 || count > most) return Result::out_of_range;
  if (first != player_.next_index()) {
    detail = player_.next_index();
    return Result::wrong_index;
  }
  if (count > player_.room()) {
    detail = player_.room();
    return Result::buffer_full;
  }
  return Result::ok;
}

Result Rig::handle(const Setpoints &command, uint16_t &detail) {
  if (mode_ != Mode::position) return Result::wrong_state;
  const Result result = may_add(command.first, command.count, 4, detail);
  if (result != Result::ok) return result;
  Knot knots[4];
  const Knot *before = player_.fresh() ? nullptr : &player_.newest();
  for (uint8_t k = 0; k < command.count; ++k) {  // all of them or none
    knots[k] = {{command.position_1[k], command.position_2[k]},
                {command.velocity_1[k], command.velocity_2[k]}};
    for (uint8_t j = 0; j < 2; ++j) {
      const int32_t p = knots[k].position[j];
      if (p < fixed_.span_low[j] || p > fixed_.span_high[j]) return Result::out_of_range;
      if (before && (p - before->position[j] > kJump || p - before->position[j] < -kJump))
        return Result::out_of_range;
    }
    before = &knots[k];
  }
  for (uint8_t k = 0; k < command.count; ++k)
    player_.add(knots[k], command.final && k == command.count - 1);
  return Result::ok;
}

Result Rig::handle(const Drives &command, uint16_t &detail) {
  if (mode_ != Mode::open_loop) return Result::wrong_state;
  const Result result = may_add(command.first, command.count, 8, detail);
  if (result != Result::ok) return result;
  const Drive second = drive(1);
  for (uint8_t k = 0; k < command.count; ++k) {  // all of them or none
    if ((second != Drive::stepper && command.rate[k] != 0) ||
        (second != Drive::motor && command.voltage_2[k] != 0))
      return Result::out_of_range;
  }
  for (uint8_t k = 0; k < command.count; ++k) {
    const int16_t asked = second == Drive::motor ? command.voltage_2[k] : command.rate[k];
    player_.add({{0, 0}, {command.voltage[k], asked}}, command.final && k == command.count - 1);
  }
  return Result::ok;
}

Result Rig::handle(const Start &command, uint16_t &detail) {
  if (state_ != State::armed) return Result::wrong_state;
  if (command.period_log2 > 6) return Result::out_of_range;
  const uint8_t waiting = player_.waiting();
  if (waiting < 2 && !(waiting == 1 && player_.closed())) {
    detail = waiting;
    return Result::not_ready;
  }
  const bool tracks = mode_ == Mode::position;
  Tick begin = {{0, 0}};
  if (tracks) {
    CriticalSection section;  // positions of one tick
    begin = {{player_.first().position[0], player_.first().position[1]}};
    target_ = begin;
    for (uint8_t j = 0; j < 2; ++j) {
      const int32_t off = error(j);
      if (off > fixed_.limits.following[j] || off < -fixed_.limits.following[j]) {
        detail = static_cast<uint16_t>(j + 1);
        return Result::out_of_range;
      }
    }
  }
  player_.start(command.period_log2, tracks, fixed_.setpoint_filter);
  CriticalSection section;
  if (state_ != State::armed) return Result::wrong_state;  // a fault meanwhile
  target_ = begin;
  pid_[1].start(pid_[1].output());  // a stepper may still be braking
  final_ = false;
  return enter(State::armed, State::running) ? Result::ok : Result::wrong_state;
}

Result Rig::handle(const Halt &, uint16_t &) {
  CriticalSection section;
  if (!enter(State::running, State::armed)) return Result::wrong_state;
  player_.clear();
  return Result::ok;
}

Result Rig::handle(const Clear &command, uint16_t &detail) {
  CriticalSection section;
  if (state_ != State::fault) return Result::wrong_state;
  Fault still = standing(fixed_.limits, in_);
  if (fault_ == Fault::bad_configuration && !stored_) still = fault_;
  // Travel, speed and the like are gone with the outputs off; arming looks again. Readings matter
  // only where they were the reason.
  const bool reading = still == Fault::supply_low || still == Fault::supply_high ||
                       still == Fault::flex_low || still == Fault::flex_high;
  if (reading && still != fault_) still = Fault::none;
  if (command.fault != static_cast<uint8_t>(fault_)) still = fault_;
  if (still != Fault::none) {
    detail = static_cast<uint16_t>(still);
    return Result::fault_persists;
  }
  if (loses_position(fault_)) referenced_ = false;
  fault_ = Fault::none;
  enter(State::fault, State::idle);
  return Result::ok;
}

bool Rig::may_configure() const {
  return state_ == State::idle || (state_ == State::fault && fault_ == Fault::bad_configuration);
}

Result Rig::handle(const ConfigWrite &command, uint16_t &detail) {
  if (!may_configure()) return Result::wrong_state;
  detail = command.item;
  if (!in_range(command.item, command.value)) return Result::out_of_range;
  config_.values[command.item] = command.value;
  update_fixed_point();
  return Result::ok;
}

Result Rig::handle(const ConfigDefaults &, uint16_t &) {
  if (!may_configure()) return Result::wrong_state;
  config_ = default_config();
  update_fixed_point();
  return Result::ok;
}

// As to_fixed_point; a second motor needs its pins.
uint8_t Rig::convert(FixedPointConfig &fixed) const {
  const uint8_t wrong = to_fixed_point(config_, fixed);
  if (wrong == kAllValid && fixed.limits.drive[1] == Drive::motor && motors_ < 2)
    return static_cast<uint8_t>(Item::drive_2);
  return wrong;
}

// Settings that contradict each other change nothing for now, and nothing can be armed with them.
void Rig::update_fixed_point() {
  FixedPointConfig made = fixed_;
  wrong_item_ = convert(made);
  CriticalSection section;
  if (wrong_item_ != kAllValid) return;
  // Other drives count in other units: where the joints are is not known any more.
  if (made.limits.drive[1] != fixed_.limits.drive[1] || made.encoder_2 != fixed_.encoder_2)
    referenced_ = false;
  fixed_ = made;
}

}  // namespace flexura
