#include "simulation.hpp"

#include <algorithm>

#include "explicit.hpp"
#include "implicit.hpp"

namespace flexura {

std::unique_ptr<Method<double>> make_method(const std::string &name, Course<double> &course) {
  if (name == "explicit") return std::make_unique<Explicit<double>>(course);
  return std::make_unique<Implicit<double>>(course);
}

Simulation::Simulation(std::shared_ptr<const Model<double>> model, Acting acting, const Request &request)
    : model_(std::move(model)), work_(*model_), plant_(*model_, work_), acting_(std::move(acting)), acting_pointer_(&acting_),
      loop_(plant_, &acting_pointer_, request.times, request.rtol), method_(make_method(request.method, loop_.course)) {
  loop_.interrupt = &interrupt;
  if (request.most_steps > 0) loop_.most_steps = request.most_steps;
  const double span = request.times.back() - request.times.front();
  loop_.start(request.q.data(), request.v.data(), request.first_step > 0.0 ? request.first_step : 1e-4 * span);
}

bool Simulation::advance(long steps) { return loop_.advance(*method_, steps); }

}  // namespace flexura
