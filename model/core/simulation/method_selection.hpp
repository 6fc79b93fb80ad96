// The method "auto" (102): which method takes fewest passes is measured, not guessed.
//
// A run begins with exponential steps (first_steps.hpp); then the others go on from the same state
// for SHORT passes. The one that gets furthest a pass, in the second half of its trial, goes on
// from where its trial ended; what the others did is forgotten. The race is held again where
// progress a pass has fallen to a quarter, at most once in AGAIN passes. Passes are counted, not
// time: a run's digits do not depend on the machine's load.
//
// There is no race either where exponential steps end soon (first_steps.hpp), or where it is
// decided beforehand: rigid robots without gains or friction and tolerances below 1e-9 are for
// explicit steps; a slider on a link that moves through a sleeve is for implicit ones, as its modes
// change with every step. Under a caller's function and under a sampled controller the run does not
// go back: exponential and implicit steps are tried one after the other.
#pragma once
#include <array>
#include <memory>

#include "simulation/first_steps.hpp"
#include "simulation/method_by_name.hpp"

namespace flexura {

class MethodSelection {
 public:
  // DEAR: passes a second of explicit steps beyond which a sharp tolerance is left to a race
  // without exponential ones. STRONG: the rate at which a damper stops its joint [1/s] beyond which
  // it couples the modes so much that only implicit steps are long.
  static constexpr double DEAR = 2e6, STRONG = 1000.0;
  static constexpr long TRIAL = 100, SHORT = 60,
                        AGAIN = 1500;  // TRIAL: of exponential steps in later races
  static constexpr double SLOWER = 4.0;
  static constexpr double FASTER = 1.5, FEW = 300.0,
                          COSTLY = 2.5;   // under a caller's function: see race_forward
  static constexpr double SEVERAL = 1.8;  // steps of order 2 a tick: more are for order 4,
  static constexpr long ENOUGH = 1000;    // of so many at least

  MethodSelection(Loop<double> &run, double tolerance,
                  const ExponentialOptions &options = ExponentialOptions())
      : loop(run),
        rtol(tolerance),
        exponential(run.integration, tolerance, options),
        implicit(run.integration),
        explicit_(run.integration) {}

  // At most so many steps further; is the robot still running?
  bool advance(long steps) {
    if (!chosen) choose();
    while (steps > 0 && loop.any()) {
      if (in_window == 0) window_passes = loop.integration.passes, window_t = loop.run_state[0].t;
      const long some = std::min(
          steps, WINDOW - in_window);  // windows do not depend on how many steps are asked for
      loop.advance(*chosen, some);
      steps -= some, in_window = (in_window + some) % WINDOW;
      if (gives_way() || in_window > 0) continue;
      if (second_order && chosen == second_order && several_a_tick()) chosen = &implicit;
      const double progress =
          (loop.run_state[0].t - window_t) /
          static_cast<double>(std::max(loop.integration.passes - window_passes, 1L));
      if (raced && loop.any() && progress * SLOWER < speed && since_race() > AGAIN) race();
    }
    return loop.any();
  }

  // For a robot whose exponential steps were made in a pack: does another method get further a pass
  // than these did? The run, which has just been started, is of no use after that.
  bool outdone(double exponential_speed, double step) {
    Best best{Mark(), &exponential, exponential_speed};
    race_of_others(mark(loop.record[0].rows), step, best);
    return best.method != &exponential;
  }

  const char *name() const { return chosen ? chosen->name() : "auto"; }
  int races() const { return held; }
  const Exponential<double> &exponential_steps() const { return exponential; }

 private:
  static constexpr long WINDOW = 50;  // steps between two looks at the progress
  Loop<double> &loop;
  const double rtol;
  Exponential<double> exponential;
  Implicit<double> implicit;
  Explicit<double> explicit_;
  std::unique_ptr<Method<double>> for_ticks;  // under a sampled controller
  Method<double> *chosen = nullptr, *second_order = nullptr;
  bool sharp = false;  // a tolerance that exponential steps are not for
  bool raced = false,
       goes_on = false;  // goes_on: with the exponential steps that the run began with
  int held = 0;
  long last_race = 0, in_window = 0, window_passes = 0;
  double window_t = 0.0;
  double speed = 0.0;  // seconds a pass, when chosen

  bool several_a_tick() const {
    const RunState &c = loop.run_state[0];
    return FirstSteps::attempts(c) >= ENOUGH &&
           static_cast<double>(FirstSteps::attempts(c)) > SEVERAL * static_cast<double>(c.tick);
  }

  // A state of the loop to come back to, with the rows recorded since another one.
  struct Mark {
    std::vector<double> z, t, state, drive;
    RunState run_state;
    ErrorNorm<double>::Sizes sizes;
    int rows = 0;
  };
  Mark mark(int since) const {
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
  void go_back(const Mark &m, int since) {
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

  void choose() {
    Integration<double> &c = loop.integration;
    const Inputs &acting = c.acts_of(0);
    const bool bends = c.n > c.plant.joints;
    const auto resistance = [&](int i) { return larger(c.plant.viscous[i], c.plant.coulomb[i]); };
    sharp = rtol < SHARPEST;
    if (explicit_without_trial(rtol, bends, c.plant.joints, acting, resistance) &&
        !(bends && hopeless(1.0 / DEAR)))
      chosen = &explicit_;
    else if (acting.sampler)
      chosen = method_under_ticks(acting.rate_Hz, bends);
    else if (bends && !sharp && strongest_damper() > STRONG)
      chosen = &implicit;
    else if (acting.function)
      chosen = !bends          ? static_cast<Method<double> *>(&explicit_)
               : c.plant.rides ? &implicit
                               : race_forward(implicit);
    else
      race();
  }

  // The largest rate at which gains and friction of a joint would stop it, its link's bending free
  // [1/s].
  double strongest_damper() {
    Integration<double> &c = loop.integration;
    const double *q = c.z.data(), *v = q + c.n;
    c.acts.at(loop.run_state[0].t), c.acts.load(q, v);
    const std::vector<double> still(std::size_t(c.n), 0.0);
    std::vector<double> force(still), rest(still), moved(still),
        reaction(std::size_t(c.plant.joints), 0.0);
    PassInputs<double> pass = c.acts.pass(q, still.data(), q, still.data(), 0.0, 0.0);
    pass.force = force.data();
    c.plant.accelerate(pass, rest.data(), reaction.data());
    double most = 0.0;
    for (int i = 0; i < c.plant.joints; ++i) {
      const std::size_t joint = std::size_t(i), row = std::size_t(c.plant.first[joint]);
      const double resistance =
          pass.damping[joint] + c.plant.viscous[joint] + c.plant.coulomb[joint] / c.plant.slow;
      if (pass.held[joint] || !(resistance > 0.0)) continue;
      force[row] = 1.0;
      c.plant.accelerate(pass, moved.data(), reaction.data());
      force[row] = 0.0, most = std::max(most, resistance * (moved[row] - rest[row]));
    }
    return most;
  }

  // The highest frequency or rate of decay where the run is [rad/s].
  double fastest() {
    Integration<double> &c = loop.integration;
    const double *q = c.z.data(), *v = q + c.n;
    c.acts.at(loop.run_state[0].t), c.acts.load(q, v);
    return c.plant.fastest(q, c.acts.pass(q, v, q, v, 0.0, 0.0));
  }
  // Are explicit steps, of 12 passes and as long as they may be, slower than that?
  bool hopeless(double speed_) { return Explicit<double>::STABLE < 12.0 * speed_ * fastest(); }

  // Where exponential steps go on that a run has begun with, their own attempts are counted, which
  // are the same in a pack.
  long since_race() const {
    return goes_on ? FirstSteps::attempts(loop.run_state[0]) : loop.integration.passes - last_race;
  }

  // How far methods got so far in a race.
  struct Best {
    Mark state;
    Method<double> *method;
    double speed;  // seconds a pass
  };
  bool over() const {
    const Status status = loop.run_state[0].status;
    return status == Status::limit || status == Status::interrupted || status == Status::done;
  }

  // The exponential steps that a run begins with: their speed, as far as `pace` tells it; have they
  // no rival?
  bool begin_exponential(double &reached) {
    FirstSteps pace;
    while (loop.advance(exponential, 1) && pace.look(loop.run_state[0])) {
    }
    reached = pace.speed(loop.run_state[0]);
    return pace.settled(loop.run_state[0]);
  }

  void race() {
    const int since = loop.record[0].rows;
    const Mark start = mark(since);
    const bool begun = chosen == nullptr;
    Best best{Mark(), nullptr, -1.0};
    double step = start.run_state.wish;
    goes_on = false;
    if (!sharp && !loop.integration.plant.rides) {
      double reached = 0.0;
      if (begun && begin_exponential(reached)) {
        chosen = &exponential, raced = goes_on = true, speed = reached;
        return;
      }
      if (!begun) loop.run_state[0].fresh = true, reached = trial(exponential, TRIAL);
      best = {mark(since), &exponential, reached}, step = loop.run_state[0].wish;
    }
    if (!over()) race_of_others(start, step, best);
    go_back(best.state, since);
    loop.resume(*best.method);
    chosen = best.method, speed = best.speed, raced = true, last_race = loop.integration.passes,
    ++held;
    goes_on = begun && chosen == &exponential;
  }

  // Under a sampled controller: explicit steps if they are few a tick, else exponential or implicit
  // ones.
  Method<double> *method_under_ticks(double rate_Hz, bool bends) {
    for_ticks = make_method(method_for_ticks(rate_Hz, fastest(), rtol), loop.integration);
    if (for_ticks->name() == std::string(TR_BDF2.name)) second_order = for_ticks.get();
    const bool stiff = second_order || for_ticks->name() == std::string(ESDIRK_4.name);
    return stiff && bends && !sharp && !loop.integration.plant.rides ? race_forward(*for_ticks)
                                                                     : for_ticks.get();
  }

  // The better one of exponential and implicit steps, which are tried one after the other on the
  // way: neither a controller nor a caller's function sees a time twice. Exponential steps go on as
  // long as they get faster, or if the rest of the run takes few of them.
  Method<double> *race_forward(Method<double> &other) {
    const RunState &c = loop.run_state[0];
    double reached = -1.0;
    for (double before = reached; !over(); before = reached) {
      reached = trial(exponential, TRIAL);
      if (reached > 0.0 && (c.end - c.t) < FEW * reached) return &exponential;
      if (!(reached > FASTER * before)) break;
    }
    if (over()) return &exponential;
    loop.run_state[0].fresh = true;
    return COSTLY * trial(other, 2 * TRIAL) > reached ? &other : &exponential;
  }

  // The other methods from `start` on, `step` being the first one that they try, against the best
  // one so far.
  void race_of_others(const Mark &start, double step, Best &best) {
    const int since = start.rows;
    for (Method<double> *method : std::array<Method<double> *, 2>{&implicit, &explicit_}) {
      if (method == &explicit_ && hopeless(best.speed)) break;
      go_back(start, since);
      loop.run_state[0].fresh = true, loop.run_state[0].wish = std::max(step, start.run_state.wish);
      const double got = trial(*method, SHORT);
      if (over() || got > best.speed || best.method == nullptr) best = {mark(since), method, got};
      if (over()) break;
    }
  }

  // Seconds a pass in the second half of `most` passes; -1: the method got stuck.
  double trial(Method<double> &method, long most) {
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

  // Where exponential steps get stuck, implicit ones may not.
  bool gives_way() {
    RunState &c = loop.run_state[0];
    if (chosen != &exponential || (c.status != Status::stuck && c.status != Status::diverged))
      return false;
    chosen = &implicit, raced = false, in_window = 0;
    c.status = Status::running, c.fresh = true, c.failed = 0;
    c.wish = 1e-6 * (c.end - c.t);
    return true;
  }
};

}  // namespace flexura
