// One robot's run from a request to its record: the time loop, the methods that it may take, how
// far it is.
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "control/inputs.hpp"
#include "integration/run_record.hpp"
#include "integration/run_state.hpp"
#include "robot/model.hpp"

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

  ~Simulation();

  // At most so many steps further; may it go on?
  bool advance(long steps);

  // Goes on to a later end, after what acts has been changed: see Loop::go_on. `most_steps` are
  // counted from here.
  void go_on(double end, double horizon, bool jumped);
  Inputs &acting();

  // Of "auto", a run that has just been made: see MethodSelection::outdone.
  bool outdone(double exponential_speed, double step);

  const RunState &run_state() const;
  const Record &record() const;
  const Model<double> &model() const { return *model_; }
  long passes() const;
  std::string method() const;
  std::vector<double> state() const;
  std::atomic<bool> interrupt{false};

 private:
  struct Parts;  // the robot's workspace, the time loop and its method
  std::shared_ptr<const Model<double>> model_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace flexura
