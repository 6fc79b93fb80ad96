// A sampled controller of all joints: at each tick it measures, computes, and holds its outputs until the next.
//
// The law of one joint, with T the tick, e = r - q, w and s the deflection and slope of the last flexible link's tip:
//
//   u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + ks s + kt s' + kv r' + kc sign r' + f(t)
//
// It is the board's own law (firmware/lib/control/src/law.h), here in floating point. r: the reference through a first-order filter; r': its
// change / T; q': the filtered change of q / T, and of a stepper that counts its own pulses u of the tick before; w, s: the mean of two
// ticks, every second tick, through a filter of their own, w' its change / 2T; joint i takes them in ticks k with
// k mod 2 = i mod 2 (i from 0). Filters: y += a (x - y), a = 1 - exp(-2 pi f T). u becomes a force (times FORCE) or a stepper's rate,
// after a whole number of ticks. Where there is a linear law (linear_law.hpp) it takes the place of the terms in e, w and s.
#pragma once
#include <memory>

#include "acting.hpp"
#include "law.h"
#include "linear_law.hpp"
#include "tip.hpp"

namespace flexura {

// What law.h needs of floating point numbers. Gains are those of a tick: ki T, slew T.
struct Reals {
  using Output = double;
  using Wish = double;
  struct Gains {
    double kp = 0.0, ki = 0.0, kd = 0.0, kv = 0.0, kc = 0.0, limit = 0.0, slew = 0.0;
  };
  struct Signals {
    double error, rate, setpoint_rate, tip;
  };
  class Sum {
   public:
    explicit Sum(double value = 0.0) : sum_(value) {}
    void add(double a, double b) { sum_ += a * b; }
    void add_long(double a, double b) { sum_ += a * b; }
    void add(double value) { sum_ += value; }
    double value() const { return sum_; }
    double top() const { return sum_; }
    double whole() const { return sum_; }

   private:
    double sum_;
  };
  static double error(const Gains &, const Signals &in) { return in.error; }
  static double difference(double a, double b) { return a - b; }
  static double narrow(double wish) { return wish; }
};

// Columns of a joint's row of gains; flexura/control.py has the same. LIMIT, SLEW (a second) of the output; FORCE: of a unit of it;
// SETPOINT, DERIVATIVE, DEFLECTION: a of the filters (the last is joint 1's); COUNT, DUTY: what position and output are rounded to (0:
// nothing); ENCODER: a stepper's joint is measured; RIGID: no spring between pulses and joint; DELAY [ticks].
enum Gain {
  KP, KI, KD, KF, KG, KS, KT, KV, KC, LIMIT, SLEW, FORCE, SETPOINT, DERIVATIVE, DEFLECTION, COUNT, DUTY, ENCODER, RIGID, DELAY, GAINS
};

enum class Output { none, effort, stepper };  // none: the joint is not this controller's

struct ControlledJoint {
  Output output = Output::none;
  Signal reference, feedforward;
  double gain[GAINS] = {};
  double stiffness = 0.0, damping = 0.0;  // between a stepper's pulses and the joint; damping also of a motor's back-EMF
};

class Controller : public Sampler {
 public:
  // What the log keeps of each joint and tick: filtered reference, output as given, three coefficients of the segment held from
  // then on (a force: only the first), filtered tip deflection.
  static constexpr int LOGGED = 6;

  Controller(std::shared_ptr<const Model<double>> robot, std::vector<ControlledJoint> joints, double rate_Hz, double quantum,
             LinearLaw linear = {});

  // Goes to work on a robot that starts at q (n): as before tick 0, with its drives and what is held put into `acting`.
  void start(Acting &acting, const double *q);
  // Other gains for all joints (N, GAINS), before a start.
  void set_gains(const double *rows);

  void tick(long k, double t, const double *q, const double *v, SampledOutput &held) override;
  // The same from what is measured: positions of the joints (N), bend of the last flexible link.
  void step(long k, double t, const double *positions, const Bend &bend, SampledOutput &held);

  const Model<double> &robot() const { return *robot_; }
  int count() const { return int(joints_.size()); }
  double rate_Hz() const { return rate_; }
  long ticks() const { return ticks_; }
  const std::vector<double> &log() const { return log_; }  // (ticks, N, LOGGED)
  const ControlledJoint &joint(int i) const { return joints_[std::size_t(i)]; }
  double output(int i) const { return memory_[std::size_t(i)].law.output(); }  // u of the last tick, before its delay
  double given(int i) const { return memory_[std::size_t(i)].given; }
  const LinearLaw &linear() const { return linear_; }

 private:
  struct Memory {
    Law<Reals> law;
    double position = 0.0, speed = 0.0;        // q of the tick before; q' filtered
    double reference = 0.0, setpoint_rate = 0.0;
    double pulses = 0.0, place = 0.0;          // counted by the law; where the delayed pulses are
    double tip = 0.0;                          // strip's part of u
    double given = 0.0;
    std::vector<double> ring;                  // outputs of the last ticks
  };
  struct Filtered {
    double before = 0.0, value = 0.0, rate = 0.0;
  };

  std::shared_ptr<const Model<double>> robot_;
  std::vector<ControlledJoint> joints_;
  double rate_, quantum_;
  int strip_;  // the link whose tip is measured; -1: none
  LinearLaw linear_;
  std::vector<Memory> memory_;
  Filtered deflection_, slope_;
  long ticks_ = 0;
  std::vector<double> log_, positions_;

  void sense(long k, const Bend &bend);
  void smooth(long k, double reading, Filtered &out) const;
  void calculate(int i, long k, double t, double position);
  void give(int i, long k, double t, SampledOutput &held);
};

}  // namespace flexura
