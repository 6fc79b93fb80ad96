// Quadrature decoder, four counts a cycle, made for the interrupt of every edge: eight bits wide, no branches to speak of.
#pragma once
#include <stdint.h>

namespace flexura {

// Lines are (A << 1) | B; A leading B counts up. The counters wrap; whoever reads them takes differences in time.
class Quadrature {
 public:
  void start(uint8_t lines) { last_ = lines; }

  void update(uint8_t lines) {
    const uint8_t changed = lines ^ last_;
    if (changed == 3) {  // both at once: an edge was missed, and with it the direction
      ++missed_;
      alone_ = 0;
    } else if (changed) {
      // The count goes up when the line that changed now differs from the other one (A), or equals it (B).
      const bool differ = (lines == 1 || lines == 2), up = differ == (changed == 2);
      count_ += up ? 1 : -1;
      if (changed == edge_) {
        if (alone_ != 255) ++alone_;
      } else {
        alone_ = 0;
      }
      edge_ = changed;
    }
    last_ = lines;
  }

  uint8_t count() const { return count_; }
  uint8_t missed() const { return missed_; }
  // Edges in a row of one and the same line: a shaft that turns alternates them, a broken wire does not.
  uint8_t alone() const { return alone_; }
  void pair() { alone_ = 0; }

 private:
  uint8_t count_ = 0, missed_ = 0, alone_ = 0;
  uint8_t last_ = 0, edge_ = 0;
};

}  // namespace flexura
