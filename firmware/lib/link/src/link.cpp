#include "link.h"

#include <string.h>

namespace flexura {

namespace {
constexpr uint8_t kUnknown = 255;

// The length of a command's fields, or kUnknown.
uint8_t size_of(uint8_t code) {
  switch (code) {
    case Hello::kCode: return Hello::kSize;
    case Keepalive::kCode: return Keepalive::kSize;
    case Stop::kCode: return Stop::kSize;
    case Reference::kCode: return Reference::kSize;
    case Arm::kCode: return Arm::kSize;
    case Setpoints::kCode: return Setpoints::kSize;
    case Drives::kCode: return Drives::kSize;
    case Start::kCode: return Start::kSize;
    case Halt::kCode: return Halt::kSize;
    case Clear::kCode: return Clear::kSize;
    case ConfigRead::kCode: return ConfigRead::kSize;
    case ConfigWrite::kCode: return ConfigWrite::kSize;
    case ConfigSave::kCode: return ConfigSave::kSize;
    case ConfigDefaults::kCode: return ConfigDefaults::kSize;
    default: return kUnknown;
  }
}

uint32_t hash_in(const uint8_t *fields) {
  Hello hello;
  memcpy(&hello, fields, sizeof hello);
  return hello.declaration;
}
}  // namespace

uint8_t Link::announce(uint8_t *frame) const {
  Identity identity = {};
  identity.declaration = kDeclaration;
  identity.protocol = kProtocolVersion;
  memcpy(identity.firmware, build_.firmware, sizeof identity.firmware);
  memcpy(identity.compiler, build_.compiler, sizeof identity.compiler);
  identity.reset = build_.reset;
  identity.state = static_cast<uint8_t>(rig_.state());
  identity.fault = static_cast<uint8_t>(rig_.fault());
  identity.configuration_crc = crc16(reinterpret_cast<const uint8_t *>(&rig_.config()), sizeof(Config));
  identity.tick = rig_.now();
  return encode(0, identity, frame);
}

uint8_t Link::telemetry(uint16_t busy, uint8_t *frame) {
  Telemetry report;
  rig_.report(report);
  report.busy = busy;
  return encode(reports_++, report, frame);
}

uint8_t Link::value(uint8_t item, uint8_t *frame) const {
  const ConfigValue value = {item, reinterpret_cast<const float *>(&rig_.config())[item]};
  return encode(receiver_.sequence(), value, frame);
}

uint8_t Link::answer(Result result, uint16_t detail, uint8_t *frame) {
  ack_.command = receiver_.code();
  ack_.result = static_cast<uint8_t>(result);
  ack_.detail = result == Result::ok ? 0 : detail;
  return encode(receiver_.sequence(), ack_, frame);
}

uint8_t Link::saved(bool well, uint8_t *frame) {
  saving_ = false;
  if (well) rig_.stored();
  ack_ = {ConfigSave::kCode, static_cast<uint8_t>(well ? Result::ok : Result::not_stored), 0};
  return encode(last_, ack_, frame);
}

uint8_t Link::take(uint8_t byte, uint8_t *answer_) {
  return receiver_.take(byte) ? obey(answer_) : 0;
}

uint8_t Link::obey(uint8_t *frame) {
  const uint8_t code = receiver_.code(), length = size_of(code);
  const uint16_t sequence = receiver_.sequence();

  // What is no command of this protocol changes nothing, not even the count, nor is it a sign of life.
  const Ack kept = ack_;
  if (length == kUnknown || length != receiver_.size()) {
    const uint8_t size = answer(length == kUnknown ? Result::unknown_command : Result::wrong_length, 0, frame);
    ack_ = kept;
    return size;
  }
  if (code == Stop::kCode) {                                  // at once, whatever its number
    uint16_t detail;
    rig_.command(code, nullptr, detail);
    if (open_ && sequence == static_cast<uint16_t>(last_ + 1)) {
      last_ = sequence;
      saving_ = false;
      rig_.host_spoke();
      return answer(Result::ok, 0, frame);
    }
    const uint8_t size = answer(Result::ok, 0, frame);
    ack_ = kept;
    return size;
  }
  if (open_ && sequence == last_) {                           // again: the same answer, if it was the same command
    if (code != ack_.command || saving_) return 0;
    uint8_t size = 0;
    if (code == ConfigRead::kCode && ack_.result == static_cast<uint8_t>(Result::ok)) size = value(receiver_.fields()[0], frame);
    return static_cast<uint8_t>(size + encode(sequence, ack_, frame + size));
  }
  if (code == Hello::kCode) {
    const bool same = hash_in(receiver_.fields()) == kDeclaration;
    const bool calm = rig_.state() == State::idle || rig_.state() == State::fault;
    if (same && calm) open_ = true, saving_ = false, last_ = sequence, reports_ = 0;
    const uint8_t size = announce(frame);
    return static_cast<uint8_t>(
        size + answer(!same ? Result::wrong_declaration : calm ? Result::ok : Result::wrong_state,
                      static_cast<uint16_t>(rig_.state()), frame + size));
  }
  if (saving_) return 0;                                      // the answer to it comes first
  if (!open_ || sequence != static_cast<uint16_t>(last_ + 1)) {
    const uint8_t size = answer(Result::out_of_sequence, static_cast<uint16_t>(last_ + 1), frame);
    ack_ = kept;
    return size;
  }

  last_ = sequence;
  rig_.host_spoke();
  uint16_t detail = 0;
  if (code == ConfigRead::kCode) {
    const uint8_t item = receiver_.fields()[0];
    if (item >= kConfigItems) return answer(Result::out_of_range, 0, frame);
    const uint8_t size = value(item, frame);
    return static_cast<uint8_t>(size + answer(Result::ok, 0, frame + size));
  }
  if (code == ConfigSave::kCode) {
    if (!rig_.may_configure()) return answer(Result::wrong_state, static_cast<uint16_t>(rig_.state()), frame);
    if (rig_.wrong_item() != kConsistent) return answer(Result::inconsistent, rig_.wrong_item(), frame);
    ack_.command = code;
    saving_ = true;                                           // answered by saved()
    return 0;
  }
  const Result result = rig_.command(code, receiver_.fields(), detail);
  return answer(result, detail, frame);
}

}  // namespace flexura
