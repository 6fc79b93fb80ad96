#include "control/inputs.hpp"

#include <utility>

namespace flexura {

ForceFunction backlash_forces(std::vector<Backlash> contacts, std::vector<int> first) {
  return [contacts = std::move(contacts), first = std::move(first)](
             double t, const double *q, const double *v, double *force) {
    for (const Backlash &c : contacts) {
      const std::size_t joint = std::size_t(c.joint);
      const Motion r = evaluate(c.motion, t);
      const double e = q[first[joint]] - r.y, half = 0.5 * c.play;
      if (-half <= e && e <= half) continue;
      force[joint] +=
          -c.stiffness * (e > half ? e - half : e + half) - c.damping * (v[first[joint]] - r.yd);
    }
  };
}

}  // namespace flexura
