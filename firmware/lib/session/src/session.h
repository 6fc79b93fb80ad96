// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The board's end of a session: which command is new, which is a repetition, and what is answered.
#pragma once
#include "frame.h"
#include "rig.h"

namespace flexura {

struct Build {
  uint8_t firmware[3];
  uint8_t compiler[3];
  uint8_t reset;
  uint32_t pins;  // hash of [pins]
};

class Session {
 public:
  Session(Rig &rig, const Build &build) : rig_(rig), build_(build) {}

  // Takes a byte, writes what is to be sent at once and returns its length.
  static constexpr uint8_t kAnswerMaxBytes = 64;
  uint8_t receive(uint8_t byte, uint8_t *answer);

  bool open() const { return open_; }  // telemetry may flow
  uint8_t announce(uint8_t *frame) const;
  uint8_t telemetry(uint16_t busy, uint8_t *frame);
  void skip_report() { ++reports_; }  // there was no room for it

  // A config_save waits for the memory: store the settings, then say how it went and send the
  // answer. begin_saving() is true once for each config_save.
  bool saving() const { return saving_; }
  bool begin_saving();
  uint8_t saved(bool well, uint8_t *frame);

 private:
  uint8_t handle_command(uint8_t *frame);
  uint8_t stop(uint8_t *frame);
  uint8_t repeat(uint8_t *frame);
  uint8_t hello(uint8_t *frame);
  uint8_t config_read(uint8_t *frame);
  uint8_t config_save(uint8_t *frame);
  uint8_t program_read(uint8_t *frame);
  uint8_t refuse(Result result, uint16_t detail, uint8_t *frame);
  uint8_t answer(Result result, uint16_t detail, uint8_t *frame);
  uint8_t value(uint8_t item, uint8_t *frame) const;
  uint8_t program(uint8_t *frame) const;
  bool next_in_order() const;

  Rig &rig_;
  const Build &build_;
  Receiver receiver_;
  bool open_ = false;
  bool saving_ = false;
  bool save_begun_ = false;
  uint16_t last_ = 0;  // sequence number of the last command obeyed
  Ack ack_ = {};       // and its answer
  uint8_t read_ = 0;   // the item that was read last
  uint16_t reports_ = 0;
};

}  // namespace flexura
