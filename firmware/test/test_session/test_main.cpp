// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the session says, byte for byte, and what it keeps of one command for the next.
#include "bench.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static uint8_t answer[Session::kAnswerMaxBytes];
static uint8_t answer_size;

static uint8_t send(Session &session, uint8_t code, uint16_t sequence, const void *fields = nullptr,
                    uint8_t size = 0) {
  uint8_t frame[kFrameMaxBytes];
  const uint8_t length = encode(code, sequence, fields, size, frame);
  for (uint8_t k = 0; k < length; ++k) answer_size = session.receive(frame[k], answer);
  return answer_size;
}

// The last frame of the answer with this code, as it came; false if there is none.
template <class Message>
static bool found(Message &message, uint16_t &sequence, const uint8_t *bytes, uint8_t size) {
  Receiver host;
  bool there = false;
  for (uint8_t k = 0; k < size; ++k)
    if (host.take(bytes[k]) && host.code() == Message::kCode && host.size() == Message::kSize) {
      memcpy(&message, host.fields(), Message::kSize);
      sequence = host.sequence();
      there = true;
    }
  return there;
}

// Whether the answer ends with this acknowledgement.
static bool acknowledged(uint8_t code, uint16_t sequence, Result result, uint16_t detail = 0) {
  Ack ack;
  uint16_t number;
  return found(ack, number, answer, answer_size) && number == sequence && ack.command == code &&
         ack.result == static_cast<uint8_t>(result) && ack.detail == detail;
}

static bool hello(Session &session, uint16_t sequence, Result result = Result::ok,
                  uint16_t detail = 0) {
  const Hello command = {kDeclaration};
  send(session, Hello::kCode, sequence, &command, Hello::kSize);
  return acknowledged(Hello::kCode, sequence, result, detail);
}

static void frames_are_no_longer_and_no_shorter_than_they_may_be() {
  Receiver receiver;
  // 61 bytes of fields are the most. Then the same with bytes after its CRC: none is dropped.
  uint8_t payload[kPayloadMaxBytes + kCrcBytes + 3];
  for (uint8_t k = 0; k < kPayloadMaxBytes; ++k) payload[k] = static_cast<uint8_t>(k + 1);
  const uint32_t crc = crc32(payload, kPayloadMaxBytes);
  memcpy(payload + kPayloadMaxBytes, &crc, kCrcBytes);
  for (uint8_t more = 0; more <= 3; ++more) {
    const uint8_t size = static_cast<uint8_t>(kPayloadMaxBytes + kCrcBytes + more);
    for (uint8_t k = 0; k < more; ++k) payload[kPayloadMaxBytes + kCrcBytes + k] = 9;
    bool good = receiver.take(static_cast<uint8_t>(size + 1));
    for (uint8_t k = 0; k < size; ++k) {
      CHECK(payload[k] != 0);  // one block of COBS
      good = receiver.take(payload[k]) || good;
    }
    CHECK(!good && receiver.take(0) == (more == 0));
  }
  // A CRC with less than a head before it: right, and no frame.
  for (uint8_t size = 0; size < kHeadBytes; ++size) {
    const uint32_t short_crc = crc32(payload, size);
    uint8_t bytes[kHeadBytes + kCrcBytes];
    memcpy(bytes, payload, size);
    memcpy(bytes + size, &short_crc, kCrcBytes);
    bool good = false;
    uint8_t block = 0, stuffed[kHeadBytes + kCrcBytes + 2], at = 1;
    for (uint8_t k = 0; k < size + kCrcBytes; ++k) {
      if (bytes[k]) {
        stuffed[at++] = bytes[k];
      } else {
        stuffed[block] = static_cast<uint8_t>(at - block);
        block = at++;
      }
    }
    stuffed[block] = static_cast<uint8_t>(at - block);
    stuffed[at++] = 0;
    for (uint8_t k = 0; k < at; ++k) good = receiver.take(stuffed[k]) || good;
    CHECK(!good);
  }
  CHECK(!receiver.take(0));
}

static void the_board_says_who_it_is() {
  healthy();
  tick(3);
  rig.tick(out);  // called in two places it is not inlined, for which avr-gcc 5.4 lacks registers
  rig.trip(Fault::speed_2);
  const Build build = {{1, 2, 3}, {4, 5, 6}, 7, 8};
  Session session(rig, build);
  Identity who;
  uint16_t sequence;
  uint8_t frame[kFrameMaxBytes];
  CHECK(found(who, sequence, frame, session.announce(frame)) && sequence == 0);
  CHECK(who.declaration == kDeclaration && who.protocol == kProtocolVersion);
  CHECK(who.firmware[0] == 1 && who.firmware[1] == 2 && who.firmware[2] == 3);
  CHECK(who.compiler[0] == 4 && who.compiler[1] == 5 && who.compiler[2] == 6 && who.reset == 7);
  CHECK(who.state == static_cast<uint8_t>(State::fault));
  CHECK(who.fault == static_cast<uint8_t>(Fault::speed_2) && who.tick == 5);
  const float *values = rig.config().values;
  CHECK(who.configuration_crc ==
        crc32(reinterpret_cast<const uint8_t *>(values), sizeof rig.config().values));
  CHECK(hello(session, 3, Result::ok));
  CHECK(found(who, sequence, answer, answer_size) && who.tick == 5);
  send(session, ProgramRead::kCode, 4);
  Program program;
  CHECK(found(program, sequence, answer, answer_size) && sequence == 4);
  CHECK(program.firmware == kFirmware && program.pins == 8 && program.proven == kFirmware);
  CHECK(program.stop == static_cast<uint8_t>(StopTrial::untried));
  CHECK(acknowledged(ProgramRead::kCode, 4, Result::ok));
}

static void reports_are_numbered_from_the_hello_on() {
  healthy();
  Session session(rig, kBuild);
  Telemetry report;
  uint16_t sequence;
  uint8_t frame[kFrameMaxBytes];
  for (uint16_t round = 0; round < 2; ++round) {
    CHECK(hello(session, 500));
    for (uint16_t k = 0; k < 3; ++k) {
      CHECK(
          found(report, sequence, frame, session.telemetry(static_cast<uint16_t>(70 + k), frame)));
      CHECK(sequence == k && report.busy == 70 + k && report.tick == rig.now());
    }
    session.skip_report();
    session.telemetry(0, frame);
    CHECK(found(report, sequence, frame, session.telemetry(1, frame)) && sequence == 5);
    CHECK(hello(session, 600 + round) && send(session, Keepalive::kCode, 601 + round) > 0);
  }
}

static void each_refusal_has_its_reason_and_leaves_no_trace() {
  healthy();
  Session session(rig, kBuild);
  send(session, Keepalive::kCode, 5);
  CHECK(acknowledged(Keepalive::kCode, 5, Result::out_of_sequence, 1));
  CHECK(hello(session, 10));
  uint8_t item = 3;
  send(session, ConfigRead::kCode, 11, &item, 1);
  CHECK(acknowledged(ConfigRead::kCode, 11, Result::ok));
  send(session, 99, 12);
  CHECK(acknowledged(99, 12, Result::unknown_command));
  send(session, Keepalive::kCode, 12, &item, 1);
  CHECK(acknowledged(Keepalive::kCode, 12, Result::wrong_length));
  send(session, Keepalive::kCode, 14);
  CHECK(acknowledged(Keepalive::kCode, 14, Result::out_of_sequence, 12));
  // After all of these the last command obeyed is answered again as it was.
  send(session, ConfigRead::kCode, 11, &item, 1);
  CHECK(acknowledged(ConfigRead::kCode, 11, Result::ok));
  ConfigValue value;
  uint16_t sequence;
  CHECK(found(value, sequence, answer, answer_size) && value.item == 3 && sequence == 11);
  CHECK(value.value == rig.config().values[3]);
  const uint8_t others[] = {4, kConfigItems, 204};
  for (const uint8_t other_item : others) {  // the number counts, not what the frame says
    send(session, ConfigRead::kCode, 11, &other_item, 1);
    CHECK(found(value, sequence, answer, answer_size) && value.item == 3);
    CHECK(value.value == rig.config().values[3]);
  }
  item = kConfigItems;
  send(session, ConfigRead::kCode, 12, &item, 1);
  CHECK(acknowledged(ConfigRead::kCode, 12, Result::out_of_range));
  item = kConfigItems - 1;
  send(session, ConfigRead::kCode, 13, &item, 1);
  CHECK(acknowledged(ConfigRead::kCode, 13, Result::ok));
  const Arm arm = {2};
  send(session, Arm::kCode, 14, &arm, 1);
  CHECK(acknowledged(Arm::kCode, 14, Result::not_referenced));
  send(session, Halt::kCode, 15);
  CHECK(acknowledged(Halt::kCode, 15, Result::wrong_state));
  const Reference here = {0, 0, 0};
  send(session, Reference::kCode, 16, &here, Reference::kSize);
  send(session, Arm::kCode, 17, &arm, 1);
  CHECK(acknowledged(Arm::kCode, 17, Result::ok));
  CHECK(hello(session, 40, Result::wrong_state, static_cast<uint16_t>(State::armed)));
  send(session, ConfigSave::kCode, 18);
  CHECK(acknowledged(ConfigSave::kCode, 18, Result::wrong_state,
                     static_cast<uint16_t>(State::armed)));
  const Hello other = {kDeclaration ^ 1};
  send(session, Hello::kCode, 50, &other, Hello::kSize);
  CHECK(acknowledged(Hello::kCode, 50, Result::wrong_declaration, 1));
}

static void a_stop_is_obeyed_at_once_and_counts_only_in_order() {
  healthy();
  Session session(rig, kBuild);
  CHECK(hello(session, 10));
  const Reference here = {0, 0, 0};
  const Arm arm = {2};
  send(session, Reference::kCode, 11, &here, Reference::kSize);
  send(session, Arm::kCode, 12, &arm, 1);
  CHECK(rig.state() == State::armed);
  send(session, Stop::kCode, 999);
  CHECK(acknowledged(Stop::kCode, 999, Result::ok) && rig.state() == State::idle);
  send(session, Arm::kCode, 13, &arm, 1);  // the number was not used
  CHECK(acknowledged(Arm::kCode, 13, Result::ok));
  send(session, Stop::kCode, 14);
  CHECK(acknowledged(Stop::kCode, 14, Result::ok) && rig.state() == State::idle);
  send(session, Arm::kCode, 14, &arm, 1);  // its number is used: a replay of it has no answer
  CHECK(answer_size == 0 && rig.state() == State::idle);
  // A stop ends a save that waits; it may be asked for again.
  send(session, ConfigSave::kCode, 15);
  CHECK(session.saving() && session.begin_saving());
  send(session, Stop::kCode, 16);
  CHECK(!session.saving() && !session.begin_saving());
  send(session, ConfigSave::kCode, 17);
  CHECK(session.saving() && session.begin_saving());
  CHECK(hello(session, 30) && !session.saving());  // so does a new session
  send(session, ConfigSave::kCode, 31);
  CHECK(session.saving() && session.begin_saving());
  uint8_t frame[kFrameMaxBytes];
  answer_size = session.saved(true, answer);
  CHECK(acknowledged(ConfigSave::kCode, 31, Result::ok));
  send(session, ConfigSave::kCode, 32);
  CHECK(session.saving() && session.begin_saving());  // the memory is written anew
  answer_size = session.saved(false, answer);
  CHECK(acknowledged(ConfigSave::kCode, 32, Result::not_stored));
  CHECK(session.announce(frame) > 0);
}

// Only what is stored ends the fault of a board without settings.
static void settings_are_stored_only_if_the_memory_says_so() {
  for (uint8_t well = 0; well < 2; ++well) {
    fresh_rig();
    rig.begin(nullptr, 1, kFirmware);
    rig.inputs().flex = 3500;
    rig.inputs().supply = 500;
    Session session(rig, kBuild);
    CHECK(hello(session, 1));
    send(session, ConfigSave::kCode, 2);
    CHECK(session.saving());
    session.saved(well, answer);
    const Clear clear = {static_cast<uint8_t>(Fault::bad_configuration)};
    send(session, Clear::kCode, 3, &clear, 1);
    CHECK(acknowledged(Clear::kCode, 3, well ? Result::ok : Result::fault_persists,
                       well ? 0 : static_cast<uint16_t>(Fault::bad_configuration)));
  }
}

// Ticks until the host is silent, if a command is sent three times, each 100 ticks.
static uint16_t silent_after(uint8_t code, bool repeated) {
  healthy();
  Session session(rig, kBuild);
  CHECK(hello(session, 10));
  const Reference here = {0, 0, 0};
  const Arm arm = {2};
  send(session, Reference::kCode, 11, &here, Reference::kSize);
  send(session, Arm::kCode, 12, &arm, 1);
  uint16_t number = 13;
  for (uint16_t k = 1; k < 600; ++k) {
    tick();
    if (rig.state() == State::fault) return rig.fault() == Fault::host_silent ? k : 0;
    if (k % 100 == 0 && k < 400) {
      send(session, code, number);
      if (!repeated) ++number;
    }
  }
  return 0;
}

static void only_new_commands_are_a_sign_of_life() {
  CHECK(silent_after(Keepalive::kCode, false) == 501);  // 0.2 s after the last, at 300
  CHECK(silent_after(Keepalive::kCode, true) == 301);   // the second is a repetition
  CHECK(silent_after(99, false) == 201);
}

static Ack ack_of(Session &session, uint8_t code, uint16_t sequence, const void *fields,
                  uint8_t size) {
  uint8_t frame[kFrameMaxBytes], answer[Session::kAnswerMaxBytes], got = 0;
  const uint8_t length = encode(code, sequence, fields, size, frame);
  for (uint8_t k = 0; k < length; ++k) got = session.receive(frame[k], answer);
  Ack ack = {0, 255, 0};
  Receiver receiver;
  for (uint8_t k = 0; k < got; ++k)
    if (receiver.take(answer[k]) && receiver.code() == Ack::kCode &&
        receiver.sequence() == sequence)
      memcpy(&ack, receiver.fields(), sizeof ack);
  return ack;
}

static bool is(const Ack &ack, Result result) { return ack.result == static_cast<uint8_t>(result); }

static void commands_are_obeyed_once_and_in_order() {
  healthy();
  Session session(rig, kBuild);
  const Hello wrong = {kDeclaration ^ 1}, hello = {kDeclaration};
  CHECK(is(ack_of(session, Keepalive::kCode, 5, nullptr, 0), Result::out_of_sequence));
  CHECK(is(ack_of(session, Hello::kCode, 65535, &wrong, Hello::kSize), Result::wrong_declaration) &&
        !session.open());
  CHECK(is(ack_of(session, Hello::kCode, 65535, &hello, Hello::kSize), Result::ok) &&
        session.open());
  const Reference here = {100, 0, 0}, there = {200, 0, 0};
  CHECK(is(ack_of(session, Reference::kCode, 0, &here, Reference::kSize), Result::ok));
  CHECK(is(ack_of(session, Reference::kCode, 0, &there, Reference::kSize),
           Result::ok));  // repeated: answered, not done
  Telemetry report;
  rig.report(report);
  CHECK(report.position_1 == 100 && report.flags == 1 << static_cast<uint8_t>(Flag::referenced));
  CHECK(
      is(ack_of(session, Reference::kCode, 2, &there, Reference::kSize), Result::out_of_sequence));
  CHECK(ack_of(session, Reference::kCode, 65535, &there, Reference::kSize).detail == 1);
  CHECK(
      is(ack_of(session, Reference::kCode, 1, &there, Reference::kSize - 1), Result::wrong_length));
  CHECK(is(ack_of(session, 99, 1, nullptr, 0), Result::unknown_command));
  const Arm arm = {2};
  CHECK(is(ack_of(session, Arm::kCode, 1, &arm, Arm::kSize), Result::ok));
  CHECK(is(ack_of(session, Hello::kCode, 9, &hello, Hello::kSize), Result::wrong_state));
  CHECK(is(ack_of(session, Stop::kCode, 40000, nullptr, 0), Result::ok) &&
        rig.state() == State::idle);
  CHECK(is(ack_of(session, Stop::kCode, 2, nullptr, 0), Result::ok));
  CHECK(is(ack_of(session, ConfigSave::kCode, 3, nullptr, 0), static_cast<Result>(255)) &&
        session.saving());
  uint8_t frame[kFrameMaxBytes];
  CHECK(session.saved(true, frame) && !session.saving());
  CHECK(is(ack_of(session, ConfigSave::kCode, 3, nullptr, 0), Result::ok) && !session.saving());
}

static void tests() {
  RUN(frames_are_no_longer_and_no_shorter_than_they_may_be);
  RUN(the_board_says_who_it_is);
  RUN(reports_are_numbered_from_the_hello_on);
  RUN(each_refusal_has_its_reason_and_leaves_no_trace);
  RUN(a_stop_is_obeyed_at_once_and_counts_only_in_order);
  RUN(settings_are_stored_only_if_the_memory_says_so);
  RUN(only_new_commands_are_a_sign_of_life);
  RUN(commands_are_obeyed_once_and_in_order);
}
CHECK_MAIN(tests())
