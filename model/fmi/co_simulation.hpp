// A robot that is moved from one communication point to the next: what FMI 2.0 and 3.0 ask for,
// without their words.
//
// One run goes on from step to step (Simulation::go_on), so that tolerance, method and length of
// steps are those of a run that was asked for at once. Inputs hold, or go on as a polynomial in
// time, from one communication point to the next.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "dynamics/places/outputs.hpp"
#include "fmi/robot_file.hpp"
#include "simulation/simulation.hpp"

namespace flexura {

// Where variables stand among the value references, for N links: the time, then N of each kind,
// the tolerance, the columns of an Observer, three energies, the sensors. Not all are in a model
// description: flexura/interchange/fmu/variables.py has the same order.
struct References {
  unsigned position, velocity, drive, motor_position, motor_velocity, tolerance, seen, accounts,
      sensors, end;
  References(unsigned links, unsigned columns, unsigned sensor_count)
      : position(1),
        velocity(position + links),
        drive(velocity + links),
        motor_position(drive + links),
        motor_velocity(motor_position + links),
        tolerance(motor_velocity + links),
        seen(tolerance + 1),
        accounts(seen + columns),
        sensors(accounts + 3),
        end(sensors + sensor_count) {}
};

class CoSimulation {
 public:
  static constexpr int ORDERS = 5;               // derivatives of an input, at most
  static constexpr long MOST_STEPS = 1'000'000;  // of the integrator between communication points

  // The state between two steps.
  struct State {
    bool started = false;
    double t = 0.0;
    std::vector<double> q, v, accounts, force;
  };

  // Functions throw std::exceptions whose texts are for the user.
  explicit CoSimulation(const RobotFile &file);

  double get(unsigned reference);
  void set(unsigned reference, double value);
  // The derivative of an input at the next communication step's start, of that order.
  void set_derivative(unsigned reference, int order, double value);

  void set_tolerance(double rtol);  // unless the parameter has been set
  // The run is to begin at t; it is known to end at `stop`, or infinity.
  void schedule(double t, double stop);
  void start();
  // From t on by h; false: a joint has met its limit, at time().
  bool step(double t, double h);

  double time() const { return now_.t; }
  const std::string &message() const { return message_; }  // of a limit
  State state() const;
  void restore(const State &state);

 private:
  std::shared_ptr<const Model<double>> model_;
  std::vector<double> limits_;
  std::vector<LinkSensor> sensors_;
  bool in_equilibrium_;
  Observer<double> observer_;
  Workspace<double> work_;
  References at_;
  double rtol_, stop_;
  bool rtol_given_ = false, placed_ = false, observed_ = false, ended_ = false;
  State now_;
  std::vector<double> begun_;  // accounts when the run in progress began
  std::vector<double> seen_;
  std::vector<Segment> inputs_;  // of the next step, per link
  std::unique_ptr<Simulation> run_;
  std::string message_;

  void place();
  void observe();
  void set_start(std::size_t link, double value, bool rate);
  double sensed(const LinkSensor &sensor);
  void begin_run(double h);
};

}  // namespace flexura
