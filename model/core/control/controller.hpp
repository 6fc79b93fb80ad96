// A sampled controller (control_law.hpp) at work on a robot: its gains as rows of numbers, what it
// measures of a state, and the drives through which its outputs act: a force, a motor's force_per_u
// u - damping eta' (62), or a stepper's pulses with or without a magnetic spring (63).
#pragma once
#include <memory>

#include "control/control_law.hpp"

namespace flexura {

// Columns of a joint's row of gains; flexura/control.py has the same. JO, BO: of the
// nominal joint. LIMIT, SLEW (a second) of the
// output; FORCE: of a unit of it; SETPOINT, DERIVATIVE, DEFLECTION, OBSERVER: a of the filters (the
// strip's is joint 1's); COUNT, DUTY: what position and output are rounded to (0: nothing);
// ENCODER: a stepper's joint is measured; RIGID: no spring between pulses and joint; DELAY [ticks].
enum Gain {
  KP,
  KI,
  KD,
  KF,
  KG,
  KS,
  KT,
  KV,
  KC,
  JO,
  BO,
  LIMIT,
  SLEW,
  FORCE,
  SETPOINT,
  DERIVATIVE,
  DEFLECTION,
  OBSERVER,
  COUNT,
  DUTY,
  ENCODER,
  RIGID,
  DELAY,
  GAINS
};

// What stands between a joint's output and the joint: a stepper's magnetic spring, or a motor's
// resistance to turning (damping alone).
struct Coupling {
  double stiffness = 0.0, damping = 0.0;
};

class Controller : public Sampler {
 public:
  // joints: outputs, references and feedforwards of a Law; their gains come by `set_gains`.
  Controller(std::shared_ptr<const Model<double>> robot, std::vector<JointLaw> joints,
             std::vector<Coupling> couplings, double rate_Hz, double quantum, LinearLaw linear);

  // Gains of all joints (N, GAINS), before a start.
  void set_gains(const double *rows);
  // Goes to work on a robot that starts at q (n): as before tick 0; `acting` gets this controller,
  // the drives of its joints, and what is held until tick 0: a stepper's joint where it is.
  void start(Inputs &acting, const double *q);

  void tick(long k, double t, const double *q, const double *v, SampledOutput &held) override {
    law_.tick(k, t, q, v, held);
  }
  // The same from what is measured, without a robot: positions of the joints (N), bend of the last
  // flexible link.
  void step(long k, double t, const double *positions, const Bend &bend, SampledOutput &held);

  const ControlLaw &law() const { return law_; }
  const Model<double> &robot() const { return *robot_; }
  int count() const { return int(law_.joints.size()); }
  long ticks() const { return long(law_.log.size()) / count(); }
  bool owns(int i) const { return law_.joints[std::size_t(i)].output != JointLaw::Output::none; }
  // Joint i's tick k in the log.
  const Tick &logged(long k, int i) const { return law_.log[std::size_t(k * count() + i)]; }

 private:
  std::shared_ptr<const Model<double>> robot_;
  std::vector<Coupling> couplings_;
  ControlLaw law_;
};

}  // namespace flexura
