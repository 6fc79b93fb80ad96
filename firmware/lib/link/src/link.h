// The board's end of the link: which command is new, which is a repetition, and what is answered.
#pragma once
#include "frame.h"
#include "rig.h"

namespace flexura {

struct Build {
  uint8_t firmware[3], compiler[3], reset;
};

class Link {
 public:
  Link(Rig &rig, const Build &build) : rig_(rig), build_(build) {}

  // Takes a byte; writes what is to be sent at once and returns its length, at most kAnswerMaxBytes.
  static constexpr uint8_t kAnswerMaxBytes = 64;
  uint8_t take(uint8_t byte, uint8_t *answer);

  bool open() const { return open_; }                       // a session is: telemetry may flow
  uint8_t announce(uint8_t *frame) const;
  uint8_t telemetry(uint16_t busy, uint8_t *frame);
  void skip() { ++reports_; }                               // a report for which there was no room

  // A config_save waits for storage: do it, then say how it went and send the answer.
  bool saving() const { return saving_; }
  uint8_t saved(bool well, uint8_t *frame);

 private:
  uint8_t obey(uint8_t *answer);
  uint8_t answer(Result result, uint16_t detail, uint8_t *frame);
  uint8_t value(uint8_t item, uint8_t *frame) const;

  Rig &rig_;
  const Build &build_;
  Receiver receiver_;
  bool open_ = false, saving_ = false;
  uint16_t last_ = 0;                                       // sequence number of the last command obeyed
  Ack ack_ = {};                                            // and its answer
  uint16_t reports_ = 0;
};

}  // namespace flexura
