// The methods of the time loop by name, the same for one robot and for four at once.
#pragma once
#include <memory>
#include <string>

#include "explicit.hpp"
#include "implicit.hpp"

namespace flexura {

// The first step to try, as a share of the time of the whole run.
constexpr double FIRST_STEP = 1e-4;

// Names: "auto", "explicit", "implicit".
template <class Real>
std::unique_ptr<Method<Real>> make_method(const std::string &name, Course<Real> &course) {
  if (name == "explicit") return std::make_unique<Explicit<Real>>(course);
  return std::make_unique<Implicit<Real>>(course);
}

}  // namespace flexura
