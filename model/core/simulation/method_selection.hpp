// The method "auto" (103): which method takes fewest passes is measured, not guessed.
//
// A run begins with exponential steps (first_steps.hpp); then the others go on from the same state
// for SHORT passes. The one that gets furthest a pass, in the second half of its trial, goes on
// from where its trial ended; what the others did is forgotten. The methods are compared again
// where progress a pass has fallen to a quarter, at most once in AGAIN passes, and where the rest
// of the run takes more than LONG passes: a fast transient at the start may have favoured the wrong
// one. The second kind of comparison waits for twice as many passes each time. Passes are counted,
// not time: a run's digits do not depend on the machine's load.
//
// Exponential steps that get stuck may have lost the motion before: the run begins again with
// implicit steps, where a caller's function or a controller does not forbid it.
//
// There is no comparison either where exponential steps end soon (first_steps.hpp), or where it is
// decided beforehand: rigid robots without gains or friction and tolerances below 1e-9 are for
// explicit steps; a slider on a link that moves through a sleeve is for implicit ones, as its modes
// change with every step. Under a caller's function and under a sampled controller the run does not
// go back: exponential and other steps are tried one after the other, and again where progress a
// pass has fallen to a quarter.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "integration/time_loop.hpp"
#include "simulation/first_steps.hpp"
#include "simulation/method_by_name.hpp"

namespace flexura {

class MethodSelection {
 public:
  static constexpr long TRIAL = 100, SHORT = 60,
                        AGAIN = 1500;  // TRIAL: of exponential steps in later comparisons
  static constexpr double SLOWER = 4.0, LONG = 100'000.0;
  // Under a caller's function or a sampled controller: see compare_forward. Where each pass calls a
  // function, a pass of exponential steps must get so much further.
  static constexpr double FASTER = 1.5, FEW = 300.0, COSTLY = 2.5;
  static constexpr double SEVERAL = 1.8;  // steps of order 2 a tick: more are for order 4,
  static constexpr long ENOUGH = 1000;    // of so many at least

  MethodSelection(Loop<double> &run, double tolerance,
                  const ExponentialOptions &wanted = ExponentialOptions())
      : loop(run), rtol(tolerance), options(wanted) {}

  // At most so many steps further; is the robot still running?
  bool advance(long steps);

  // For a robot whose exponential steps were made in a pack: does another method get further a pass
  // than these did? The run, which has just been started, is of no use after that.
  bool outdone(double exponential_speed, double step);

  // The run is never begun again before where it is.
  void begin_here() { begun = loop.snapshot(); }

  const char *name() const { return chosen ? chosen->name() : "auto"; }

 private:
  static constexpr long WINDOW = 50;  // steps between two looks at the progress
  using Steps = std::unique_ptr<Method<double>>;

  // A state of the loop to come back to, with the rows recorded since another one.
  struct Mark {
    std::vector<double> z, t, state, drive;
    RunState run_state;
    ErrorNorm<double>::Sizes sizes;
    int rows = 0;
  };
  // How far methods got so far in a comparison.
  struct Best {
    Mark state;
    Method<double> *method;
    double speed;  // seconds a pass
  };

  Loop<double> &loop;
  const double rtol;
  const ExponentialOptions options;
  Steps exponential_, implicit_, explicit_, for_ticks;  // the last under a sampled controller
  Method<double> *chosen = nullptr, *second_order = nullptr;
  bool sharp = false;  // a tolerance that exponential steps are not for
  bool compared = false,
       goes_on = false;          // goes_on: with the exponential steps that the run began with
  Loop<double>::Snapshot begun;  // where the run started
  long patience = AGAIN;         // passes before a comparison that is made as the rest is long
  long last_comparison = 0, in_window = 0, window_passes = 0;
  double window_t = 0.0;
  double speed = 0.0;                    // seconds a pass, when chosen
  std::vector<Method<double> *> others;  // that exponential steps are tried beside, on the way
  double dear = 1.0;                     // by how much a pass of theirs is cheaper

  // A method, made when it is first needed.
  Method<double> *made(Steps &steps, const char *name) {
    if (!steps) steps = make_method(name, loop.integration, rtol, options);
    return steps.get();
  }
  Method<double> *exponential() { return made(exponential_, "exponential"); }
  Method<double> *implicit() { return made(implicit_, "implicit"); }
  Method<double> *by_explicit() { return made(explicit_, "explicit"); }

  bool several_a_tick() const;
  Mark mark(int since) const;
  void go_back(const Mark &m, int since);
  void choose();
  bool hopeless(double speed_);
  long since_comparison() const;
  bool over() const;
  bool begin_exponential(double &reached);
  void compare();
  Method<double> *method_under_ticks(double rate_Hz, bool bends);
  Method<double> *compare_forward(std::vector<Method<double> *> tried, double costly);
  Method<double> *compare_forward();
  void compare_others(const Mark &start, double step, Best &best);
  double trial(Method<double> &method, long most);
  bool gives_way();
  bool due(double progress);
  bool slower(double progress) const;
};

}  // namespace flexura
