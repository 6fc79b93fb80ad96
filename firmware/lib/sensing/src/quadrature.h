// Quadrature decoder, four counts a cycle, made for the interrupts of every edge: eight bits wide, one table.
#pragma once
#include <stdint.h>

namespace flexura {

enum class EncoderLine : uint8_t { a = 0, b = 1 };

// Lines are (A << 1) | B; A leading B counts up. Counters wrap or are zeroed: whoever reads them does so once a tick.
class Quadrature {
 public:
  // More edges of one line in a tick are noise, and no shaft: four times what 20 000 edges a second of both lines need.
  static constexpr uint8_t kEdgesMost = 40;

  void start(uint8_t lines) { last_ = static_cast<uint8_t>(lines << 2); }

  // An edge of this line came. False when the line is flooded and its interrupt should be shut.
  bool update(EncoderLine line, uint8_t lines) {
    static const uint8_t kChange[16] = {0, 0xFF, 1, kMissed, 1, 0, kMissed, 0xFF, 0xFF, kMissed, 0, 1, kMissed, 1, 0xFF, 0};
    const uint8_t change = kChange[last_ | lines];
    last_ = static_cast<uint8_t>(lines << 2);
    if (change == kMissed) {
      missed_ = static_cast<uint8_t>(missed_ + 1);   // both lines changed: an edge was missed, and with it the direction
    } else {
      count_ = static_cast<uint8_t>(count_ + change);
    }
    uint8_t &edges = edges_[static_cast<uint8_t>(line)];
    return ++edges < kEdgesMost;
  }

  uint8_t count() const { return count_; }
  uint8_t missed() const { return missed_; }
  uint8_t take_edges(EncoderLine line) {
    const uint8_t edges = edges_[static_cast<uint8_t>(line)];
    edges_[static_cast<uint8_t>(line)] = 0;
    return edges;
  }

 private:
  static constexpr uint8_t kMissed = 2;

 public:                                 // for the board's interrupts, which do the ordinary edge by hand
  uint8_t count_ = 0, missed_ = 0, last_ = 0;   // last: the lines, << 2
  uint8_t edges_[2] = {0, 0};
};

}  // namespace flexura
