// The time loop, for every method: outputs, breaks, ticks of a sampled controller, control of the
// step, limits, failures.
//
//     Loop<double> loop(plant, &acting, times, rtol);   Explicit<double> method(loop.integration);
//     loop.start(q0, v0, first_step);
//     while (loop.advance(method, 1000)) ...            // progress, interruption, another method
//
// A step never crosses a break (a signal's corner, a tick). The state at a tick is the state of the
// step that ends there, so that a controller is called once a tick in order of time. Outputs
// between are taken from the method's dense output.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "integration/joint_limits.hpp"
#include "integration/method.hpp"
#include "integration/run_record.hpp"
#include "integration/run_state.hpp"

namespace flexura {

template <class Real>
class Loop {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  Integration<Real> integration;
  std::array<RunState, LANES> run_state;
  std::array<Record, LANES> record;
  long most_steps =
      std::numeric_limits<long>::max();  // budget: accepted and rejected steps of a robot
  double longest = RunState::NEVER;      // no step is longer [s]
  static constexpr double PART = 0.15;   // nor than this part of the shortest period of a signal
  static constexpr double LEAST_STEPS =
      100.0;  // of a run under a function of the caller's, whose waves are not known
  const std::atomic<bool> *interrupt = nullptr;  // stops the run where it is
  std::atomic<double> *progress = nullptr;       // the time reached by the slowest robot

  // acting: one for each robot. times: of the outputs, ascending; the first is the start.
  Loop(Plant<Real> &plant, Inputs *const *acting, std::vector<double> times, double rtol)
      : integration(plant, acting, rtol),
        outputs(std::move(times)),
        row_state(padded(integration.size), Real(0.0)),
        plain(integration.size, 0.0) {
    for (int k = 0; k < LANES; ++k) {
      breaks[k] = acting[k]->breaks(), most[k] = PART * acting[k]->shortest_period();
      if (acting[k]->function)
        most[k] = std::fmin(most[k], (outputs.back() - outputs.front()) / LEAST_STEPS);
    }
  }

  void start(const Real *q0, const Real *v0, double first_step);

  // A run that is done goes on to a later end, as if it had been asked for before. `horizon`: how
  // far it may go on after that [s]; `jumped`: what acts jumps or kinks where it is.
  void go_on(double end, double horizon, bool jumped);

  // At most so many steps further with that method; is any robot still running?
  bool advance(Method<Real> &method, long steps);

  // Goes on with a method whose last step led to where the loop now is again
  // (method_selection.hpp).
  void resume(Method<Real> &method) { current = &method; }

  bool any() const {
    return std::any_of(run_state.begin(), run_state.end(),
                       [](const RunState &c) { return c.running(); });
  }

  // A rehearsal goes on from where the run is until the next tick, and is then undone: to try
  // methods without telling a controller. (The caller's own functions would see time run backwards:
  // do not rehearse with them.)
  struct Snapshot {
    std::array<RunState, LANES> run_state;
    std::array<int, LANES> rows;
    std::vector<Real> z;
    typename ErrorNorm<Real>::Sizes sizes;
  };
  Snapshot snapshot() const {
    Snapshot out{run_state, {}, integration.z, integration.weights.sizes()};
    for (int k = 0; k < LANES; ++k) out.rows[k] = record[k].rows;
    return out;
  }
  void restore(const Snapshot &from) {
    run_state = from.run_state, integration.z = from.z, integration.weights.resume(from.sizes),
    current = nullptr;
    for (int k = 0; k < LANES; ++k) record[k].rows = from.rows[k];
  }
  bool rehearsal = false;

 private:
  std::vector<double> outputs;
  std::array<std::vector<double>, LANES> breaks;
  std::vector<Real> row_state;
  std::vector<double> plain;       // one robot's state
  std::vector<double> before;      // what a sampled controller held
  std::array<double, LANES> most;  // length of a step by what acts [s]
  Method<Real> *current = nullptr;
  Real at = 0.0, length = 0.0, last = 0.0, error = 0.0, good = 0.0;
  double beyond[LANES] =
      {};  // when the step just attempted leaves a limit; minus infinity: it is not good
  bool prepared = false;

  bool tick_due() const {
    for (int k = 0; k < LANES; ++k)
      if (run_state[k].running() && run_state[k].due(integration.acts_of(k)) <= run_state[k].t &&
          run_state[k].t < run_state[k].end)
        return true;
    return false;
  }

  int count() const { return int(outputs.size()); }

  void end_all(Status status) {
    for (RunState &c : run_state)
      if (c.running()) c.status = status;
  }

  const double *state_of(int k, const Real *z) {
    for (int j = 0; j < integration.size; ++j) plain[j] = lane(z[j], k);
    return plain.data();
  }

  // At the start of a step: ticks, the equations after a jump, outputs that are due now.
  void arrive(Method<Real> &method) {
    Real which = 0.0, now = 0.0;
    bool jumped = false;
    for (int k = 0; k < LANES; ++k) {
      RunState &c = run_state[k];
      set_lane(now, k, c.t);
      if (!c.running()) continue;
      Inputs &a = integration.acts.acting(k);
      if (c.due(a) <= c.t && c.t < c.end) {
        const double *z = state_of(k, integration.z.data());
        before.assign(a.held.force.begin(), a.held.force.end());
        a.sampler->tick(c.tick++, c.t, z, z + integration.n, a.held);
        const bool moves = std::any_of(a.joints.begin(), a.joints.end(),
                                       [](const JointDrive &d) { return d.sampled; });
        c.fresh = c.fresh || moves || before != a.held.force;  // what holds as before makes no jump
      }
      c.look_ahead(breaks[k], a);
      if (c.fresh) set_lane(which, k, 1.0), jumped = true;
    }
    if (jumped) {
      method.begin(which, now);
      for (int k = 0; k < LANES; ++k) {
        if (lane(which, k) == 0.0) continue;
        run_state[k].wish = method.restart(k, run_state[k].wish, run_state[k].steps == 0);
        run_state[k].fresh = false;
      }
    }
    for (int k = 0; k < LANES; ++k) {
      RunState &c = run_state[k];
      if (!c.running() || c.row >= count() || outputs[std::size_t(c.row)] > c.t) continue;
      keep(k, c.t, integration.z.data());
      if (c.row >= count()) c.status = Status::done;
    }
  }

  // One step of every robot; the lanes that are not running step by nothing.
  void attempt(Method<Real> &method) {
    for (int k = 0; k < LANES; ++k) {
      RunState &c = run_state[k];
      set_lane(at, k, c.t), set_lane(length, k, 0.0), set_lane(last, k, c.t);
      if (!c.running()) continue;
      const double left = c.stop - c.t, ahead = outputs[c.row] - c.t;
      c.step =
          method.fit(k, std::fmin(c.wish, std::fmin(longest, most[std::size_t(k)])), left, ahead);
      c.next = c.step >= left ? c.stop : c.step == ahead ? outputs[c.row] : c.t + c.step;
      set_lane(length, k, c.step), set_lane(last, k, std::fmax(c.t, c.last()));
    }
    error = method.attempt(at, length, last);
    prepared = false, good = Real(0.0);
  }

  // Robot k: was the step good, and did it end before a limit?
  void judge(Method<Real> &method, int k) {
    RunState &c = run_state[k];
    const double e = lane(error, k);
    if (!(e < 1.0)) return reject(method, k, e);
    if (beyond[k] <= c.next) return stop_at_limit(method, k, beyond[k]);
    ++c.steps, c.failed = 0;
    const double wish = method.next(k, c.step, e, c.before, true);
    c.wish = c.step < c.wish ? std::fmax(c.wish, wish) : wish;
    c.before = std::fmax(e, 1e-4);
    set_lane(good, k, 1.0);
    if (c.next < c.end && c.steps + c.rejected >= most_steps) c.status = Status::exhausted;
  }

  void reject(Method<Real> &method, int k, double e) {
    RunState &c = run_state[k];
    ++c.rejected, ++c.failed;
    c.wish = std::isfinite(e) ? method.next(k, c.step, e, c.before, false) : 0.1 * c.step;
    const bool over = c.steps + c.rejected >= most_steps;
    if (!over && !c.too_short(c.wish)) return;
    c.status = over ? Status::exhausted : std::isfinite(e) ? Status::stuck : Status::diverged;
    const ErrorLocation spot = integration.weights.worst_spot(integration.error.data(), k);
    c.joint = spot.joint, c.elastic = spot.elastic, c.rate = spot.rate;
  }

  // After all robots are judged: good steps are taken.
  void settle(Method<Real> &method) {
    if (worst(good) > 0.0) {
      method.accept(good);
      take(good, integration.znew.data(), integration.z.data(), integration.size);
      Real look = 0.0;
      for (int k = 0; k < LANES; ++k) {
        if (lane(good, k) == 0.0) continue;
        RunState &c = run_state[k];
        c.t = c.next;
        const bool breaks_here = c.t == c.stop && c.t < c.due(integration.acts.acting(k));
        if (c.steps % 8 == 0 || breaks_here) set_lane(look, k, 1.0);
        if (c.t < c.end && (breaks_here || c.broken(breaks[k]))) c.fresh = true;
        if (c.t >= c.end) finish(k);
      }
      integration.weights.grow(integration.z.data(), look);
    }
    if (progress) {
      double slowest = RunState::NEVER;
      for (const RunState &c : run_state)
        slowest = std::fmin(slowest, c.status == Status::running ? c.t : c.end);
      progress->store(slowest, std::memory_order_relaxed);
    }
  }

  void finish(int k) {
    RunState &c = run_state[k];
    while (c.row < count()) keep(k, c.t, integration.z.data());
    c.status = Status::done;
  }

  // The state at time t inside the step just attempted, into row_state; prescribed joints are on
  // their motion.
  void between(Method<Real> &method, int k, double t) {
    if (!prepared) method.prepare(at, length, last), prepared = true;
    Real x = 0.0, now = at;
    set_lane(x, k, (t - run_state[k].t) / run_state[k].step), set_lane(now, k, t);
    method.between(length, x, row_state.data());
    integration.acts.at(now);
    integration.acts.prescribe(row_state.data(), row_state.data() + integration.n);
  }

  // A row of robot k's record: the state z at time t, and the forces of the drives there.
  void keep(int k, double t, const Real *z) {
    Real now = at;
    set_lane(now, k, t);
    if (z != row_state.data()) std::copy(z, z + integration.size, row_state.data());
    integration.acts.at(now);
    load_drives();
    write(k, t);
  }

  // The outputs on the way of the good steps just attempted: of every robot one at a time, up to
  // where it leaves a limit.
  void keep_within(Method<Real> &method) {
    for (;;) {
      Real x = 0.0, now = at;
      double due[LANES];
      bool any_due = false;
      for (int k = 0; k < LANES; ++k) {
        const RunState &c = run_state[k];
        due[k] = c.row < count() ? outputs[std::size_t(c.row)] : RunState::NEVER;
        if (!(due[k] < std::fmin(c.next, beyond[k])))
          due[k] = RunState::NEVER;
        else
          set_lane(x, k, (due[k] - c.t) / c.step), set_lane(now, k, due[k]), any_due = true;
      }
      if (!any_due) return;
      if (!prepared) method.prepare(at, length, last), prepared = true;
      method.between(length, x, row_state.data());
      integration.acts.at(now);
      integration.acts.prescribe(row_state.data(), row_state.data() + integration.n);
      load_drives();
      for (int k = 0; k < LANES; ++k)
        if (due[k] < RunState::NEVER) write(k, due[k]);
    }
  }

  // What the drives give at row_state, `acts` being at its time.
  void load_drives() {
    const Real *q = row_state.data(), *v = q + integration.n;
    integration.acts.load(q, v);
    if (integration.acts.any_prescribed()) integration.react(q, v);
  }

  // The next row of robot k's record, from row_state.
  void write(int k, double t) {
    RunState &c = run_state[k];
    Record &r = record[k];
    const Real *q = row_state.data(), *v = q + integration.n;
    const std::size_t row = static_cast<std::size_t>(r.rows++);
    r.t[row] = t;
    for (int j = 0; j < integration.size; ++j) r.state[row * r.size + j] = lane(row_state[j], k);
    for (int i = 0; i < r.joints; ++i)
      r.drive[row * r.joints + i] = lane(integration.acts.drive(i, q, v), k);
    ++c.row;
  }

  // The time inside the step at which robot k leaves its limits first; NEVER: it does not.
  double first_beyond(Method<Real> &method, int k) {
    RunState &c = run_state[k];
    const JointLimits<Real> limits(integration, k);
    const StepInterval step{c.t, c.next, outputs.data() + c.row, outputs.data() + outputs.size()};
    return limits.first_beyond(step, c.joint, [&](double t) {
      if (t >= c.next) return static_cast<const Real *>(integration.znew.data());
      between(method, k, t);
      return static_cast<const Real *>(row_state.data());
    });
  }

  // (64): the run ends where joint c.joint meets its limit.
  void stop_at_limit(Method<Real> &method, int k, double t) {
    RunState &c = run_state[k];
    if (t > c.t) {
      between(method, k, t);
      if (record[k].rows == 0 || t > record[k].t[record[k].rows - 1]) keep(k, t, row_state.data());
      for (int j = 0; j < integration.size; ++j)
        set_lane(integration.z[j], k, lane(row_state[j], k));
    }
    c.t = t, c.status = Status::limit;
  }
};

// (Not in the class: what uses a loop does not compile it.)
template <class Real>
void Loop<Real>::start(const Real *q0, const Real *v0, double first_step) {
  for (int k = 0; k < integration.n; ++k)
    integration.z[k] = q0[k], integration.z[integration.n + k] = v0[k];
  for (int k = 0; k < ACCOUNTS; ++k) integration.z[2 * integration.n + k] = Real(0.0);
  integration.end = outputs.back();
  integration.acts.at(Real(outputs.front()));
  integration.acts.prescribe(integration.z.data(), integration.z.data() + integration.n);
  integration.weights.start(integration.z.data());
  integration.znew = integration.z;
  current = nullptr;
  for (int k = 0; k < LANES; ++k) {
    run_state[k] = RunState();
    run_state[k].t = run_state[k].start = outputs.front(), run_state[k].end = outputs.back(),
    run_state[k].wish = first_step;
    record[k].open(outputs.size() + 1, integration.size, integration.plant.joints);
  }
}

template <class Real>
void Loop<Real>::go_on(double end, double horizon, bool jumped) {
  outputs.assign(1, end);
  integration.end = std::fmax(end, horizon);
  for (int k = 0; k < LANES; ++k) {
    RunState &c = run_state[k];
    const Inputs &acting = integration.acts_of(k);
    breaks[k] = acting.breaks(), most[k] = PART * acting.shortest_period();
    c.end = end, c.next_break = 0, c.row = 0, c.status = Status::running;
    c.tick += acting.sampler == nullptr;  // as many as were asked for
    c.fresh = c.fresh || jumped;
    record[k].rows = 0;
  }
}

template <class Real>
bool Loop<Real>::advance(Method<Real> &method, long steps) {
  if (current != &method)
    for (RunState &c : run_state) c.fresh = true;
  current = &method;
  for (long s = 0; s < steps && any(); ++s) {
    if (interrupt && interrupt->load(std::memory_order_relaxed)) end_all(Status::interrupted);
    if (rehearsal && tick_due()) break;
    arrive(method);
    if (!any()) break;
    attempt(method);
    for (int k = 0; k < LANES; ++k)
      beyond[k] = run_state[k].running() && lane(error, k) < 1.0 ? first_beyond(method, k)
                                                                 : -RunState::NEVER;
    keep_within(method);
    for (int k = 0; k < LANES; ++k)
      if (run_state[k].running()) judge(method, k);
    settle(method);
  }
  return any();
}

extern template class Loop<double>;
extern template class Loop<Pack<4>>;

}  // namespace flexura
