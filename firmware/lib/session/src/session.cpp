// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "session.h"

#include <string.h>

namespace flexura {

namespace {
constexpr uint8_t kUnknown = 255;

struct Size {
  uint8_t code;
  uint8_t size;
};

// The length of a command's fields, or kUnknown.
uint8_t size_of(uint8_t code) {
#define FLEXURA_SIZE(Message) {Message::kCode, Message::kSize},
  static const Size kSizes[] = {FLEXURA_RIG_COMMANDS(FLEXURA_SIZE)
                                    FLEXURA_SESSION_COMMANDS(FLEXURA_SIZE)};
#undef FLEXURA_SIZE
  for (const Size &row : kSizes)
    if (row.code == code) return row.size;
  return kUnknown;
}
}  // namespace

uint8_t Session::announce(uint8_t *frame) const {
  Identity identity = {};
  identity.declaration = kDeclaration;
  identity.protocol = kProtocolVersion;
  memcpy(identity.firmware, build_.firmware, sizeof identity.firmware);
  memcpy(identity.compiler, build_.compiler, sizeof identity.compiler);
  identity.reset = build_.reset;
  identity.state = static_cast<uint8_t>(rig_.state());
  identity.fault = static_cast<uint8_t>(rig_.fault());
  const float *values = rig_.config().values;
  identity.configuration_crc =
      crc32(reinterpret_cast<const uint8_t *>(values), sizeof rig_.config().values);
  identity.tick = rig_.now();
  return encode(0, identity, frame);
}

uint8_t Session::telemetry(uint16_t busy, uint8_t *frame) {
  Telemetry report;
  rig_.report(report);
  report.busy = busy;
  return encode(reports_++, report, frame);
}

uint8_t Session::value(uint8_t item, uint8_t *frame) const {
  const ConfigValue value = {item, rig_.config().values[item]};
  return encode(receiver_.sequence(), value, frame);
}

uint8_t Session::program(uint8_t *frame) const {
  const Program program = {rig_.firmware(), build_.pins, rig_.proven(),
                           static_cast<uint8_t>(rig_.stop_trial())};
  return encode(receiver_.sequence(), program, frame);
}

uint8_t Session::answer(Result result, uint16_t detail, uint8_t *frame) {
  ack_.command = receiver_.code();
  ack_.result = static_cast<uint8_t>(result);
  ack_.detail = result == Result::ok ? 0 : detail;
  return encode(receiver_.sequence(), ack_, frame);
}

// Answers without a trace: the answer to the last command obeyed is kept for its repetition.
uint8_t Session::refuse(Result result, uint16_t detail, uint8_t *frame) {
  const Ack kept = ack_;
  const uint8_t size = answer(result, detail, frame);
  ack_ = kept;
  return size;
}

bool Session::begin_saving() {
  const bool begins = saving_ && !save_begun_;
  save_begun_ = saving_;
  return begins;
}

uint8_t Session::saved(bool well, uint8_t *frame) {
  saving_ = false;
  if (well) rig_.stored();
  const Result result = well ? Result::ok : Result::not_stored;
  ack_ = {ConfigSave::kCode, static_cast<uint8_t>(result), 0};
  return encode(last_, ack_, frame);
}

uint8_t Session::receive(uint8_t byte, uint8_t *answer) {
  return receiver_.take(byte) ? handle_command(answer) : 0;
}

bool Session::next_in_order() const {
  return open_ && receiver_.sequence() == static_cast<uint16_t>(last_ + 1);
}

// Sequence numbers only; what a command does stands in its handler.
uint8_t Session::handle_command(uint8_t *frame) {
  const uint8_t code = receiver_.code();
  const uint8_t size = size_of(code);
  // What is no command of this protocol changes nothing, nor is it a sign of life.
  if (size == kUnknown) return refuse(Result::unknown_command, 0, frame);
  if (size != receiver_.size()) return refuse(Result::wrong_length, 0, frame);
  if (code == Stop::kCode) return stop(frame);
  if (open_ && receiver_.sequence() == last_) return repeat(frame);
  if (code == Hello::kCode) return hello(frame);
  if (saving_) return 0;  // the answer to it comes first
  if (!next_in_order())
    return refuse(Result::out_of_sequence, static_cast<uint16_t>(last_ + 1), frame);

  last_ = receiver_.sequence();
  rig_.host_spoke();
  if (code == ConfigRead::kCode) return config_read(frame);
  if (code == ConfigSave::kCode) return config_save(frame);
  if (code == ProgramRead::kCode) return program_read(frame);
  uint16_t detail = 0;
  const Result result = rig_.command(code, receiver_.fields(), detail);
  return answer(result, detail, frame);
}

// At once, whatever its number.
uint8_t Session::stop(uint8_t *frame) {
  uint16_t detail;
  rig_.command(Stop::kCode, nullptr, detail);
  if (!next_in_order()) return refuse(Result::ok, 0, frame);
  last_ = receiver_.sequence();
  saving_ = false;
  return answer(Result::ok, 0, frame);
}

// The last command again: the same answer, if it was the same command.
uint8_t Session::repeat(uint8_t *frame) {
  if (receiver_.code() != ack_.command || saving_) return 0;
  uint8_t size = 0;
  const bool read = receiver_.code() == ConfigRead::kCode;
  if (read && ack_.result == static_cast<uint8_t>(Result::ok)) size = value(read_, frame);
  if (receiver_.code() == ProgramRead::kCode) size = program(frame);
  return static_cast<uint8_t>(size + encode(receiver_.sequence(), ack_, frame + size));
}

uint8_t Session::hello(uint8_t *frame) {
  Hello command;
  memcpy(&command, receiver_.fields(), sizeof command);
  const State state = rig_.state();
  Result result = Result::ok;
  if (command.declaration != kDeclaration) {
    result = Result::wrong_declaration;
  } else if (state != State::idle && state != State::fault) {
    result = Result::wrong_state;
  } else {
    open_ = true;
    saving_ = false;
    last_ = receiver_.sequence();
    reports_ = 0;
  }
  const uint8_t size = announce(frame);
  return static_cast<uint8_t>(size + answer(result, static_cast<uint16_t>(state), frame + size));
}

uint8_t Session::config_read(uint8_t *frame) {
  const uint8_t item = receiver_.fields()[0];
  if (item >= kConfigItems) return answer(Result::out_of_range, 0, frame);
  read_ = item;
  const uint8_t size = value(item, frame);
  return static_cast<uint8_t>(size + answer(Result::ok, 0, frame + size));
}

uint8_t Session::program_read(uint8_t *frame) {
  const uint8_t size = program(frame);
  return static_cast<uint8_t>(size + answer(Result::ok, 0, frame + size));
}

uint8_t Session::config_save(uint8_t *frame) {
  if (!rig_.may_configure())
    return answer(Result::wrong_state, static_cast<uint16_t>(rig_.state()), frame);
  if (rig_.wrong_item() != kAllValid) return answer(Result::inconsistent, rig_.wrong_item(), frame);
  saving_ = true;
  save_begun_ = false;
  return 0;  // saved() answers
}

}  // namespace flexura
