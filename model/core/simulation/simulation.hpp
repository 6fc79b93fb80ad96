// One robot's run from a request to its record: the time loop, the methods that it may take, how
// far it is.
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "control/model_plant.hpp"
#include "simulation/method_selection.hpp"

namespace flexura {

struct Request {
  std::vector<double> times;  // of the outputs; the first is the start
  std::vector<double> q, v;   // (n) at the start
  double rtol = 1e-6;
  std::string method = "auto";    // or "explicit", "implicit", "exponential"
  double first_step = 0.0;        // 0: chosen
  long most_steps = 0;            // 0: no budget
  bool numerical_damping = true;  // of fast modes, by exponential steps
};

class Simulation {
 public:
  // `acting` and what it names must outlive the run.
  Simulation(std::shared_ptr<const Model<double>> model, Inputs acting, const Request &request);

  // At most so many steps further; may it go on?
  bool advance(long steps);

  // Of "auto", a run that has just been made: see MethodSelection::outdone.
  bool outdone(double exponential_speed, double step) {
    return auto_->outdone(exponential_speed, step);
  }

  const RunState &run_state() const { return loop_.run_state[0]; }
  const Record &record() const { return loop_.record[0]; }
  const Model<double> &model() const { return *model_; }
  long passes() const { return loop_.integration.passes; }
  std::string method() const { return method_ ? method_->name() : auto_->name(); }
  std::vector<double> state() const {
    return {loop_.integration.z.begin(), loop_.integration.z.begin() + loop_.integration.size};
  }
  std::atomic<bool> interrupt{false};

 private:
  std::shared_ptr<const Model<double>> model_;
  Workspace<double> work_;
  ModelPlant<double> plant_;
  Inputs acting_;
  Inputs *acting_pointer_;
  Loop<double> loop_;
  std::unique_ptr<Method<double>> method_;  // or
  std::unique_ptr<MethodSelection> auto_;
};

}  // namespace flexura
