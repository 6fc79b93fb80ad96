// What may be said about exponential steps.
#pragma once

namespace flexura {

struct ExponentialOptions {
  bool damping = true;  // of fast modes
  double zeta = 0.05;   // its ratio
  double cutoff = 0.0;  // [rad/s]; 0: from the tolerance
};

}  // namespace flexura
