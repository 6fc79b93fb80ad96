#include "simulation/method_selection.hpp"

#include <algorithm>

#include "integration/runge_kutta/implicit.hpp"

namespace flexura {

// At most so many steps further; is the robot still running?
bool MethodSelection::advance(long steps) {
  if (!chosen) choose(), gives_way();
  while (steps > 0 && loop.any()) {
    if (in_window == 0) window_passes = loop.integration.passes, window_t = loop.run_state[0].t;
    const long some = std::min(
        steps, WINDOW - in_window);  // windows do not depend on how many steps are asked for
    loop.advance(*chosen, some);
    steps -= some, in_window = (in_window + some) % WINDOW;
    if (gives_way() || in_window > 0) continue;
    if (second_order && chosen == second_order && several_a_tick()) chosen = implicit();
    const double progress =
        (loop.run_state[0].t - window_t) /
        static_cast<double>(std::max(loop.integration.passes - window_passes, 1L));
    if (compared && loop.any() && due(progress)) compare();
    if (!others.empty() && loop.any() && slower(progress)) chosen = compare_forward(), gives_way();
  }
  return loop.any();
}

// Are the methods to be compared again, at `progress` seconds a pass: is it slower, or is the rest
// long?
bool MethodSelection::due(double progress) {
  if (slower(progress)) return true;
  const double left = loop.run_state[0].end - loop.run_state[0].t;
  if (left < LONG * progress || since_comparison() < patience) return false;
  patience *= 2;
  return true;
}

// Has progress a pass fallen far since the last comparison, and that long ago?
bool MethodSelection::slower(double progress) const {
  return progress * SLOWER < speed && since_comparison() > AGAIN;
}

// For a robot whose exponential steps were made in a pack: does another method get further a pass
// than these did? The run, which has just been started, is of no use after that.
bool MethodSelection::outdone(double exponential_speed, double step) {
  Best best{Mark(), exponential(), exponential_speed};
  compare_others(mark(loop.record[0].rows), step, best);
  return best.method != exponential();
}

bool MethodSelection::several_a_tick() const {
  const RunState &c = loop.run_state[0];
  return FirstSteps::attempts(c) >= ENOUGH &&
         static_cast<double>(FirstSteps::attempts(c)) > SEVERAL * static_cast<double>(c.tick);
}

MethodSelection::Mark MethodSelection::mark(int since) const {
  const Record &r = loop.record[0];
  Mark m;
  m.z = loop.integration.z, m.run_state = loop.run_state[0], m.rows = r.rows,
  m.sizes = loop.integration.weights.sizes();
  m.t.assign(r.t.begin() + since, r.t.begin() + r.rows);
  m.state.assign(r.state.begin() + static_cast<std::ptrdiff_t>(since) * r.size,
                 r.state.begin() + static_cast<std::ptrdiff_t>(r.rows) * r.size);
  m.drive.assign(r.drive.begin() + static_cast<std::ptrdiff_t>(since) * r.joints,
                 r.drive.begin() + static_cast<std::ptrdiff_t>(r.rows) * r.joints);
  return m;
}
void MethodSelection::go_back(const Mark &m, int since) {
  Record &r = loop.record[0];
  loop.integration.z = m.z, loop.run_state[0] = m.run_state, r.rows = m.rows;
  loop.integration.weights.resume(
      m.sizes);  // what another trial has seen must not loosen the tolerance
  std::copy(m.t.begin(), m.t.end(), r.t.begin() + since);
  std::copy(m.state.begin(), m.state.end(),
            r.state.begin() + static_cast<std::ptrdiff_t>(since) * r.size);
  std::copy(m.drive.begin(), m.drive.end(),
            r.drive.begin() + static_cast<std::ptrdiff_t>(since) * r.joints);
}

void MethodSelection::choose() {
  Integration<double> &c = loop.integration;
  const Inputs &acting = c.acts_of(0);
  const bool bends = c.n > c.plant.joints;
  sharp = rtol < SHARPEST, begun = loop.snapshot();
  if (const char *name = method_without_trial(c, loop.run_state[0].t, rtol))
    compared = std::string(name) == "implicit", chosen = compared ? implicit() : by_explicit();
  else if (acting.rate_Hz > 0.0)
    chosen = method_under_ticks(acting.rate_Hz, bends);
  else if (acting.function)
    chosen = !bends          ? by_explicit()
             : c.plant.rides ? implicit()
                             : compare_forward({implicit()}, COSTLY);
  else
    compare();
}

bool MethodSelection::hopeless(double speed_) {
  return explicit_is_slower(loop.integration, loop.run_state[0].t, speed_);
}

// Where exponential steps go on that a run has begun with, their own attempts are counted, which
// are the same in a pack.
long MethodSelection::since_comparison() const {
  return goes_on ? FirstSteps::attempts(loop.run_state[0])
                 : loop.integration.passes - last_comparison;
}

bool MethodSelection::over() const {
  const Status status = loop.run_state[0].status;
  return status == Status::limit || status == Status::interrupted || status == Status::done;
}

// The exponential steps that a run begins with: their speed, as far as `pace` tells it; is no
// other method to be tried?
bool MethodSelection::begin_exponential(double &reached) {
  FirstSteps pace;
  while (loop.advance(*exponential(), 1) && pace.look(loop.run_state[0])) {
  }
  reached = pace.speed(loop.run_state[0]);
  return pace.settled(loop.run_state[0]);
}

void MethodSelection::compare() {
  const int since = loop.record[0].rows;
  const Mark start = mark(since);
  const bool begun = chosen == nullptr;
  Best best{Mark(), nullptr, -1.0};
  double step = start.run_state.wish;
  goes_on = false;
  if (!sharp && !loop.integration.plant.rides) {
    double reached = 0.0;
    if (begun && begin_exponential(reached)) {
      chosen = exponential(), compared = goes_on = true, speed = reached;
      return;
    }
    if (!begun) loop.run_state[0].fresh = true, reached = trial(*exponential(), TRIAL);
    best = {mark(since), exponential(), reached}, step = loop.run_state[0].wish;
  }
  if (!over()) compare_others(start, step, best);
  go_back(best.state, since);
  loop.resume(*best.method);
  chosen = best.method, speed = best.speed, compared = true,
  last_comparison = loop.integration.passes;
  goes_on = begun && chosen == exponential_.get();
}

// Under a sampled controller: explicit steps where one a tick is enough for the fastest mode, or
// friction stops a joint faster than exponential steps follow; else exponential ones beside others.
Method<double> *MethodSelection::method_under_ticks(double rate_Hz, bool bends) {
  const double rate = fastest(loop.integration, loop.run_state[0].t);
  for_ticks = make_method(method_for_ticks(rate_Hz, rate, rtol), loop.integration);
  if (for_ticks->name() == std::string(TR_BDF2.name)) second_order = for_ticks.get();
  if (!(rate > rate_Hz && bends) || sharp || strongly_damped(loop.integration, loop.run_state[0].t))
    return for_ticks.get();
  const bool stiff = second_order || for_ticks->name() == std::string(ESDIRK_4.name);
  return stiff ? compare_forward({for_ticks.get()}, 1.0)
               : compare_forward({for_ticks.get(), implicit()}, 1.0);
}

// The best of exponential steps and others, which are tried one after the other on the way: neither
// a controller nor a caller's function sees a time twice. Exponential steps go on as long as they
// get faster, or if the rest of the run takes few of them.
Method<double> *MethodSelection::compare_forward(std::vector<Method<double> *> tried,
                                                 double costly) {
  others = std::move(tried), dear = costly;
  return compare_forward();
}
Method<double> *MethodSelection::compare_forward() {
  const RunState &c = loop.run_state[0];
  Method<double> *best = exponential();
  loop.run_state[0].fresh = true, speed = -1.0;
  for (double before = speed; loop.any(); before = speed) {
    speed = trial(*exponential(), TRIAL);
    if (!loop.any() || (c.end - c.t) < FEW * speed) break;
    if (speed > FASTER * before) continue;
    for (Method<double> *other : others) {
      if (!loop.any()) break;
      loop.run_state[0].fresh = true;
      const double got = dear * trial(*other, 2 * TRIAL);
      if (got > speed) best = other, speed = got;
    }
    break;
  }
  loop.run_state[0].fresh = true, last_comparison = loop.integration.passes;
  return best;
}

// The other methods from `start` on, `step` being the first one that they try, against the best
// one so far.
void MethodSelection::compare_others(const Mark &start, double step, Best &best) {
  const int since = start.rows;
  for (bool last : {false, true}) {
    if (last && hopeless(best.speed)) break;
    Method<double> *method = last ? by_explicit() : implicit();
    go_back(start, since);
    loop.run_state[0].fresh = true, loop.run_state[0].wish = std::max(step, start.run_state.wish);
    const double got = trial(*method, SHORT);
    if (over() || got > best.speed || best.method == nullptr) best = {mark(since), method, got};
    if (over()) break;
  }
}

// (103): seconds a pass in the second half of `most` passes; -1: the method got stuck.
double MethodSelection::trial(Method<double> &method, long most) {
  const long begin = loop.integration.passes;
  long half = begin;
  double t = loop.run_state[0].t;
  while (loop.integration.passes - begin < most && loop.advance(method, 1))
    if (2 * (loop.integration.passes - begin) <= most)
      half = loop.integration.passes, t = loop.run_state[0].t;
  const Status status = loop.run_state[0].status;
  if (status == Status::stuck || status == Status::diverged) return -1.0;
  return (loop.run_state[0].t - t) /
         static_cast<double>(std::max(loop.integration.passes - half, 1L));
}

// Where exponential steps get stuck, implicit ones may not. They begin at the start of the run: the
// state where the others got stuck may be far off.
bool MethodSelection::gives_way() {
  RunState &c = loop.run_state[0];
  if (chosen != exponential_.get() || (c.status != Status::stuck && c.status != Status::diverged))
    return false;
  chosen = implicit(), compared = false, in_window = 0;
  const Inputs &acting = loop.integration.acts_of(0);
  if (!acting.function && !acting.sampler) {
    const long tried = c.steps + c.rejected;
    loop.restore(begun);
    c.rejected += tried;  // they count against the budget
  }
  c.status = Status::running, c.fresh = true, c.failed = 0;
  c.wish = 1e-6 * (c.end - c.t);
  return true;
}

}  // namespace flexura
