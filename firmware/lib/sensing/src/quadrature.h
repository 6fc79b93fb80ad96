// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Quadrature decoder with four counts a cycle, made for interrupts on every edge: eight bits wide.
#pragma once
#include <stdint.h>

namespace flexura {

enum class EncoderLine : uint8_t { a = 0, b = 1 };

// Lines are (A << 1) | B; A leading B counts up. `count` and `missed` wrap, `edges` are zeroed: who
// reads them does so once a tick.
//
// A plain struct, because the board's interrupts handle the ordinary edge in assembly
// (encoder_isr.h). update() is the specification of what they do.
struct Quadrature {
  // More edges of one line in a tick are noise: a shaft with 20 000 edges a second gives ten.
  static constexpr uint8_t kEdgesMax = 40;

  uint8_t count = 0;
  uint8_t missed = 0;         // both lines changed: an edge was missed, and with it the direction
  uint8_t last = 0;           // the lines of the last edge, << 2
  uint8_t edges[2] = {0, 0};  // of line A and of line B

  void start(uint8_t lines) { last = static_cast<uint8_t>(lines << 2); }

  // An edge of this line came. False if the line is flooded and its interrupt should be shut.
  bool update(EncoderLine line, uint8_t lines) {
    static const uint8_t kChange[16] = {0,    0xFF,    1, kMissed, 1,       0, kMissed, 0xFF,
                                        0xFF, kMissed, 0, 1,       kMissed, 1, 0xFF,    0};
    const uint8_t change = kChange[last | lines];
    last = static_cast<uint8_t>(lines << 2);
    if (change == kMissed) {
      missed = static_cast<uint8_t>(missed + 1);
    } else {
      count = static_cast<uint8_t>(count + change);
    }
    uint8_t &own = edges[static_cast<uint8_t>(line)];
    own = static_cast<uint8_t>(own + 1);
    return own < kEdgesMax;
  }

  // The edges of a line since the last call.
  uint8_t take_edges(EncoderLine line) {
    const uint8_t taken = edges[static_cast<uint8_t>(line)];
    edges[static_cast<uint8_t>(line)] = 0;
    return taken;
  }

 private:
  static constexpr uint8_t kMissed = 2;
};

}  // namespace flexura
