#include "simulation/simulation.hpp"

#include "simulation/method_by_name.hpp"

namespace flexura {

Simulation::Simulation(std::shared_ptr<const Model<double>> model, Inputs acting,
                       const Request &request)
    : model_(std::move(model)),
      work_(*model_),
      plant_(*model_, work_),
      acting_(std::move(acting)),
      acting_pointer_(&acting_),
      loop_(plant_, &acting_pointer_, request.times, request.rtol),
      method_(make_method<double>(request.method, loop_.integration, request.rtol,
                                  {request.numerical_damping})) {
  if (!method_)
    auto_ = std::make_unique<MethodSelection>(loop_, request.rtol,
                                              ExponentialOptions{request.numerical_damping});
  loop_.interrupt = &interrupt;
  if (request.most_steps > 0) loop_.most_steps = request.most_steps;
  const double span = request.times.back() - request.times.front();
  loop_.start(request.q.data(), request.v.data(),
              request.first_step > 0.0 ? request.first_step : FIRST_STEP * span);
}

bool Simulation::advance(long steps) {
  return method_ ? loop_.advance(*method_, steps) : auto_->advance(steps);
}

}  // namespace flexura
