// Where one robot's run is: its time, its steps, what comes next, and how it ended.
#pragma once
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "control/inputs.hpp"

namespace flexura {

enum class Status {
  running,
  done,
  limit,        // a joint met its limit: the last row is the state there
  stuck,        // no step is short enough for the tolerance
  diverged,     // the state, a force or an acceleration is not a finite number
  exhausted,    // the budget of steps is used up
  interrupted,  // from outside
};

struct RunState {
  static constexpr double NEVER = std::numeric_limits<double>::infinity();

  double t = 0.0, end = 0.0;
  double wish = 0.0;                         // the next step's length by the tolerance
  double step = 0.0, next = 0.0;             // of the step being tried: length, time at its end
  double stop = 0.0;                         // the next break, tick or the end
  double before = 1.0;                       // error of the step before
  bool fresh = true;                         // what acts may have jumped at t
  long steps = 0, rejected = 0, failed = 0;  // failed: attempts since the last good step
  long tick = 0;                             // of the sampled controller: the next one
  double start = 0.0;                        // time of tick 0
  std::size_t next_break = 0;
  int row = 0;  // the next output
  Status status = Status::running;
  int joint = -1;  // that met its limit, or where the run got stuck (-1: not known)
  bool elastic = false, rate = false;  // stuck: in the link's elastic unknowns; in rates

  bool running() const { return status == Status::running; }

  double due(const Inputs &a) const {
    return a.sampler ? start + static_cast<double>(tick) / a.rate_Hz : NEVER;
  }

  // Passes breaks up to t; the next instant at which a step must end.
  void look_ahead(const std::vector<double> &breaks, const Inputs &a) {
    while (next_break < breaks.size() && breaks[next_break] <= t) ++next_break;
    stop = std::fmin(end, due(a));
    if (next_break < breaks.size()) stop = std::fmin(stop, breaks[next_break]);
  }

  // Is there a break at t that `look_ahead` has not passed?
  bool broken(const std::vector<double> &breaks) const {
    return next_break < breaks.size() && breaks[next_break] <= t;
  }

  // The instant before the next break: signals are read no later.
  double last() const { return std::nextafter(stop, -NEVER); }

  bool too_short(double h) const {
    return !(h > 4e-16 * std::fmax(std::fabs(t), std::fabs(end - t) * 1e-3));
  }
};

}  // namespace flexura
