// The control law of a robot's joints: a PID with anti-windup (70), (72), or a linear law with an
// estimator (76), (77). At each tick it measures, computes, and holds its outputs until the next.
// The PID is the firmware's own (firmware/lib/control/src/pid.h), computed in doubles.
//
//     u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + ks s + kt s' + kv r' + kc sign r' +
//     f(t) + d^                                                                       (70), (150)
//
// r: the reference through a first-order filter; r': its change / T; q': the filtered change of q /
// T, and of a stepper that counts its own pulses u of the tick before; w, s: tip deflection and
// slope, the mean of two ticks, every second tick, through a filter of their own, w' its change /
// 2T; joint i takes them in ticks k with k mod 2 = i mod 2 (i from 0). |u| <= limit, and changes by
// at most slew T a tick. d^: what the firmware's observer makes of u and q' in the other ticks
// (disturbance_observer.h). Filters: y += a (x - y), a = 1 - exp(-2 pi f T). u becomes a force, or
// a stepper's rate, after a whole number of ticks.
//
// A linear law takes the PID's place where LinearLaw::states > 0: z^ = z + L (y - C z), u = -K z^ +
// Kr r + Kv r' + f(t), limits as above, and z of the next tick = F z^ + G u with the u that the
// limits left.
#pragma once
#include <functional>
#include <vector>

#include "control/inputs.hpp"
#include "disturbance_observer.h"
#include "dynamics/places/outputs.hpp"
#include "pid.h"

namespace flexura {

struct JointLaw {
  enum class Output {
    none,
    force,
    stepper
  };  // none: the joint is not this controller's; stepper: u is the pulses' rate
  Output output = Output::none;
  GainsOf<ModelNumbers> gains;  // SI units; ki per second, limit, slew per second
  double ks = 0.0, kt = 0.0;    // of the tip's slope and its rate
  double inertia = 0.0, damping = 0.0, observer = 0.0;  // of the nominal joint [u s^2, u s], and
                                                        // a of its filter; 0: no observer
  double force_per_u = 1.0;                             // a motor's [N/V or N m/V]
  double setpoint = 1.0, derivative = 1.0;  // a of the filters of reference and velocity; 1: none
  double count = 0.0, duty = 0.0;           // resolution of the encoder, of the output; 0: exact
  bool encoder = false;  // of a stepper: it measures the joint in place of counting pulses
  bool rigid = false;  // of a stepper: no spring between pulses and joint; the rate changes evenly
                       // over a tick
  int delay = 0;       // ticks from measurement to output
  Signal reference, feedforward;
};

// Matrices by rows. p states, N joints, M measurements: the joints', then the deflection if M > N.
struct LinearLaw {
  int states = 0, measurements = 0;
  std::vector<double> F, G, L, C, K, Kr, Kv;  // (p, p) (p, N) (p, M) (M, p) (N, p) (N, N) (N, N)
  std::vector<double> offset, hold;  // (M) measurements and (N) outputs about which it is linear
};

// What a tick leaves for the record, a joint: reference, output as given, what is held (place or
// force, rate, half its change), deflection.
struct Tick {
  double reference, output, held[3], deflection;
};

class ControlLaw : public Sampler {
 public:
  std::vector<JointLaw> joints;
  LinearLaw linear;
  double rate_Hz = 1000.0;
  double deflection = 1.0;                     // a of the filter of deflection and slope
  double quantum = 0.0;                        // of the measured deflection [m]; 0: exact
  std::vector<int> first;                      // (joints) their rows
  std::function<Bend(const double *q)> strip;  // empty: no deflection is measured
  std::vector<Tick> log;                       // (ticks, joints)

  // Back to before tick 0.
  void reset();
  void tick(long k, double t, const double *q, const double *v, SampledOutput &held) override;
  const std::vector<double> &predicted() const {
    return predicted_;
  }  // z of the linear law for the next tick

 private:
  struct Memory {
    PidOf<ModelNumbers> pid;
    DisturbanceObserverOf<ModelNumbers> observer;
    double q = 0.0, rate = 0.0, reference = 0.0, reference_rate = 0.0, u = 0.0, pulses = 0.0,
           given = 0.0, place = 0.0, added = 0.0, disturbance = 0.0;
    std::vector<double> ring;  // outputs of the last ticks
  };
  std::vector<Memory> memory_;
  std::vector<double> predicted_, estimated_, measured_;
  Bend before_, filtered_, rate_;

  void sense(long k, const double *q);
  void measure(long k, double t, std::size_t i, const double *q);
  double pid_output(long k, double t, std::size_t i);
  void estimate();
  double linear_output(double t, std::size_t i);
  void predict();
  void give(long k, double t, std::size_t i, SampledOutput &held);
  GainsOf<ModelNumbers> a_tick(const JointLaw &joint) const;
  ObserverGainsOf<ModelNumbers> nominal(const JointLaw &joint) const;
};

}  // namespace flexura
