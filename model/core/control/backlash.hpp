// Joints behind backlash: a contact that pushes a joint only where it is off a motion by more than
// half of the play.
//
//     force = -k (e -+ b/2) - c e'     |e| > b/2,   e = eta - r(t)
//     force = 0                        |e| <= b/2
#pragma once
#include <vector>

#include "control/inputs.hpp"

namespace flexura {

struct Backlash {
  int joint = 0;  // from 0
  Signal motion;  // r, of the driving side
  double play = 0.0, stiffness = 0.0, damping = 0.0;
};

// The forces of such contacts for a robot whose joints have the rows `first`. The signals' breaks
// are no ends of steps.
ForceFunction backlash_forces(std::vector<Backlash> contacts, std::vector<int> first);

}  // namespace flexura
