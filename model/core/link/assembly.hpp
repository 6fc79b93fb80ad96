// From a robot, or four at once, to its model: the pieces of all links, their unknowns numbered.
#pragma once
#include <memory>

#include "robot/input_fault.hpp"
#include "robot/model.hpp"

namespace flexura {

// The equations of a robot. Throws Fault for what cannot be one.
Model<double> assemble(const Robot &robot);

// The equations of up to four robots of one topology, each with the digits that it has alone.
// faults[k] says why robot k is none.
void assemble(const Robot *const *robots, int count, Model<double> *models,
              std::unique_ptr<Fault> *faults);

// Four robots of one topology side by side, and a robot whose numbers have no derivatives.
Model<Pack<4>> pack(const Model<double> *const robots[4]);
Model<Dual<4>> dual(const Model<double> &robot);

}  // namespace flexura
