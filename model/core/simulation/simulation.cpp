#include "simulation/simulation.hpp"

#include <stdexcept>

#include "control/model_plant.hpp"
#include "simulation/method_selection.hpp"

namespace flexura {

struct Simulation::Parts {
  Workspace<double> work;
  ModelPlant<double> plant;
  Inputs acting;
  Inputs *acting_pointer;
  Loop<double> loop;
  std::unique_ptr<Method<double>> method;  // or
  std::unique_ptr<MethodSelection> selection;
  long budget = 0;

  Parts(const Model<double> &model, Inputs inputs, const Request &request)
      : work(model),
        plant(model, work),
        acting(std::move(inputs)),
        acting_pointer(&acting),
        loop(plant, &acting_pointer, request.times, request.rtol),
        method(make_method<double>(request.method, loop.integration, request.rtol,
                                   {request.numerical_damping})) {
    if (method) return;
    if (request.method != "auto")
      throw std::invalid_argument("there is no method " + request.method);
    selection = std::make_unique<MethodSelection>(loop, request.rtol,
                                                  ExponentialOptions{request.numerical_damping});
  }
};

Simulation::Simulation(std::shared_ptr<const Model<double>> model, Inputs acting,
                       const Request &request)
    : model_(std::move(model)),
      parts_(std::make_unique<Parts>(*model_, std::move(acting), request)) {
  Loop<double> &loop = parts_->loop;
  loop.interrupt = &interrupt;
  if (request.most_steps > 0) loop.most_steps = parts_->budget = request.most_steps;
  const double span = request.times.back() - request.times.front();
  loop.start(request.q.data(), request.v.data(),
             request.first_step > 0.0 ? request.first_step : FIRST_STEP * span);
}
Simulation::~Simulation() = default;

bool Simulation::advance(long steps) {
  return parts_->method ? parts_->loop.advance(*parts_->method, steps)
                        : parts_->selection->advance(steps);
}
void Simulation::go_on(double end, double horizon, bool jumped) {
  Loop<double> &loop = parts_->loop;
  loop.go_on(end, horizon, jumped);
  if (parts_->selection) parts_->selection->begin_here();
  const RunState &c = loop.run_state[0];
  if (parts_->budget > 0) loop.most_steps = c.steps + c.rejected + parts_->budget;
}
Inputs &Simulation::acting() { return parts_->acting; }
bool Simulation::outdone(double exponential_speed, double step) {
  return parts_->selection->outdone(exponential_speed, step);
}

const RunState &Simulation::run_state() const { return parts_->loop.run_state[0]; }
const Record &Simulation::record() const { return parts_->loop.record[0]; }
long Simulation::passes() const { return parts_->loop.integration.passes; }
std::string Simulation::method() const {
  return parts_->method ? parts_->method->name() : parts_->selection->name();
}
std::vector<double> Simulation::state() const {
  const Integration<double> &run = parts_->loop.integration;
  return {run.z.begin(), run.z.begin() + run.size};
}

}  // namespace flexura
