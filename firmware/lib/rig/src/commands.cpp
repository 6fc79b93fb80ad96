// What the host may ask for, and when.
#include <string.h>

#include "rig.h"

namespace flexura {

namespace {
template <class Message>
Message fields_as(const uint8_t *fields) {
  Message message;
  memcpy(&message, fields, sizeof message);
  return message;
}

constexpr int32_t kFarthest = 1L << 22;   // counts, microsteps: as Q8 half of what 31 bits hold
bool near(int32_t value) { return value < kFarthest && value > -kFarthest; }

// After these nobody knows where the joint is.
bool loses_position(Fault fault) {
  return fault == Fault::encoder_1 || fault == Fault::encoder_2 || fault == Fault::stall_2 || fault == Fault::runaway_1 ||
         fault == Fault::runaway_2;
}
}  // namespace

Result Rig::command(uint8_t code, const uint8_t *fields, uint16_t &detail) {
  detail = static_cast<uint16_t>(state_);
  switch (code) {
    case Keepalive::kCode:
      return Result::ok;
    case Stop::kCode: {
      Section section;
      if (state_ != State::fault) state_ = State::idle;
      player_.clear();
      return Result::ok;
    }
    case Reference::kCode:
      return reference(fields_as<Reference>(fields));
    case Arm::kCode:
      return arm(fields_as<Arm>(fields).mode, detail);
    case Setpoints::kCode:
      return add_setpoints(fields_as<Setpoints>(fields), detail);
    case Drives::kCode:
      return add_drives(fields_as<Drives>(fields), detail);
    case Start::kCode:
      return start(fields_as<Start>(fields).period_log2, detail);
    case Halt::kCode: {
      Section section;
      if (state_ != State::running) return Result::wrong_state;
      state_ = State::armed;
      player_.clear();
      return Result::ok;
    }
    case Clear::kCode:
      return clear(fields_as<Clear>(fields).fault, detail);
    case ConfigWrite::kCode: {
      const ConfigWrite write = fields_as<ConfigWrite>(fields);
      return configure(write.item, write.value, detail);
    }
    case ConfigDefaults::kCode: {
      if (!may_configure()) return Result::wrong_state;
      config_ = default_config();
      rescale();
      return Result::ok;
    }
    default:
      return Result::unknown_command;
  }
}

Result Rig::reference(const Reference &command) {
  if (state_ != State::idle) return Result::wrong_state;
  if (!near(command.position_1) || !near(command.position_2) || !near(command.steps)) return Result::out_of_range;
  // Where the encoder says joint 2 is, in microsteps; the pulses must agree with it.
  const int64_t exact = static_cast<int64_t>(scales_.ratio) * command.position_2;
  const int64_t lag = (exact >> 8) - static_cast<int64_t>(command.steps) * 256;
  if (lag > scales_.limits.lost || lag < -scales_.limits.lost) return Result::out_of_range;
  Section section;
  seen_.position[0] = command.position_1;
  seen_.position[1] = command.position_2;
  steps_given_ = command.steps;
  by_encoder_ = static_cast<int32_t>(exact >> 16);
  by_encoder_rest_ = static_cast<uint16_t>(exact);
  referenced_ = true;
  return Result::ok;
}

Result Rig::arm(uint8_t mode, uint16_t &detail) {
  if (state_ != State::idle) return Result::wrong_state;
  if (mode != static_cast<uint8_t>(Mode::open_loop) && mode != static_cast<uint8_t>(Mode::position)) return Result::out_of_range;
  if (!referenced_) return Result::not_referenced;
  if (wrong_item_ != kConsistent) {
    detail = wrong_item_;
    return Result::inconsistent;
  }
  Section section;
  const Fault fault = standing(scales_.limits, in_);
  if (fault != Fault::none) {
    detail = static_cast<uint16_t>(fault);
    return Result::fault_persists;
  }
  player_.clear();
  watch_.start();
  steps_.start(steps_given_);
  tip_.start(scales_.tip, static_cast<uint16_t>(2 * in_.flex));
  flex_before_ = in_.flex;
  for (uint8_t j = 0; j < 2; ++j) {
    velocity_[j].start();
    pid_[j].start(0);
  }
  target_ = {{0, 0}};
  tip_term_[0] = tip_term_[1] = 0;
  final_ = false;
  mode_ = static_cast<Mode>(mode);
  state_ = State::armed;
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

Result Rig::add_setpoints(const Setpoints &command, uint16_t &detail) {
  if (mode_ != Mode::position) return Result::wrong_state;
  const Result result = may_add(command.first, command.count, 4, detail);
  if (result != Result::ok) return result;
  Knot knots[4];
  const Knot *before = player_.fresh() ? nullptr : &player_.newest();
  for (uint8_t k = 0; k < command.count; ++k) {   // all of them or none
    knots[k] = {{command.position_1[k], command.position_2[k]}, {command.velocity_1[k], command.velocity_2[k]}};
    for (uint8_t j = 0; j < 2; ++j) {
      const int32_t p = knots[k].position[j];
      if (p < scales_.span_low[j] || p > scales_.span_high[j]) return Result::out_of_range;
      if (before && (p - before->position[j] > kJump || p - before->position[j] < -kJump)) return Result::out_of_range;
    }
    before = &knots[k];
  }
  for (uint8_t k = 0; k < command.count; ++k) player_.add(knots[k], command.final && k == command.count - 1);
  return Result::ok;
}

Result Rig::add_drives(const Drives &command, uint16_t &detail) {
  if (mode_ != Mode::open_loop) return Result::wrong_state;
  const Result result = may_add(command.first, command.count, 8, detail);
  if (result != Result::ok) return result;
  for (uint8_t k = 0; k < command.count; ++k)
    player_.add({{0, 0}, {command.voltage[k], command.rate[k]}}, command.final && k == command.count - 1);
  return Result::ok;
}

Result Rig::start(uint8_t period_log2, uint16_t &detail) {
  if (state_ != State::armed) return Result::wrong_state;
  if (period_log2 > 6) return Result::out_of_range;
  const uint8_t waiting = player_.waiting();
  if (waiting < 2 && !(waiting == 1 && player_.closed())) {
    detail = waiting;
    return Result::not_ready;
  }
  const bool tracks = mode_ == Mode::position;
  Tick begin = {{0, 0}};
  if (tracks) {
    Section section;                                          // positions of one tick
    begin = {{player_.first().position[0], player_.first().position[1]}};
    target_ = begin;
    for (uint8_t j = 0; j < 2; ++j) {
      const int32_t off = error(j);
      if (off > scales_.limits.following[j] || off < -scales_.limits.following[j]) {
        detail = static_cast<uint16_t>(j + 1);
        return Result::out_of_range;
      }
    }
  }
  player_.start(period_log2, tracks, scales_.setpoint_filter);
  Section section;
  if (state_ != State::armed) return Result::wrong_state;     // a fault meanwhile
  target_ = begin;
  pid_[1].start(pid_[1].output());                            // it may still be braking
  final_ = false;
  state_ = State::running;
  return Result::ok;
}

Result Rig::clear(uint8_t fault, uint16_t &detail) {
  Section section;
  if (state_ != State::fault) return Result::wrong_state;
  Fault still = standing(scales_.limits, in_);
  if (fault_ == Fault::bad_configuration && !stored_) still = fault_;
  // Travel, speed and the like are gone with the outputs off; arming looks again. Readings matter only where they were the reason.
  const bool reading = still == Fault::supply_low || still == Fault::supply_high || still == Fault::flex_low || still == Fault::flex_high;
  if (reading && still != fault_) still = Fault::none;
  if (fault != static_cast<uint8_t>(fault_)) still = fault_;
  if (still != Fault::none) {
    detail = static_cast<uint16_t>(still);
    return Result::fault_persists;
  }
  if (loses_position(fault_)) referenced_ = false;
  fault_ = Fault::none;
  state_ = State::idle;
  return Result::ok;
}

bool Rig::may_configure() const {
  return state_ == State::idle || (state_ == State::fault && fault_ == Fault::bad_configuration);
}

Result Rig::configure(uint8_t item, float value, uint16_t &detail) {
  if (!may_configure()) return Result::wrong_state;
  detail = item;
  if (!in_range(item, value)) return Result::out_of_range;
  reinterpret_cast<float *>(&config_)[item] = value;
  rescale();
  return Result::ok;
}

// An inconsistent configuration changes nothing for now, and nothing can be armed with it.
void Rig::rescale() {
  Scales made = scales_;
  wrong_item_ = make_scales(config_, made);
  Section section;
  if (wrong_item_ == kConsistent) scales_ = made;
}

}  // namespace flexura
