#include "simulation/gain_sweep.hpp"

#include <atomic>
#include <stdexcept>
#include <thread>

#include "integration/time_loop.hpp"
#include "simulation/method_by_name.hpp"
#include "simulation/method_selection.hpp"

namespace flexura {
namespace {

constexpr int
    CALL = 1000,
    LOOK = 50;  // steps between two looks at a run: at how many there are; at what it costs so far
constexpr double STEPS_A_TICK =
    12.0;  // more than that on average, and a row is given up: its gains make the robot chatter
constexpr double FIRST = 1e-4;          // first step, in whole runs
constexpr double CERTAIN = 1.0 + 1e-9;  // by which a cost must exceed its limit

Inputs driven(const Plan &plan, Controller &controller) {
  Inputs acting = plan.acting;
  controller.start(acting, plan.start.data());
  return acting;
}

}  // namespace

// The memory of one run at a time.
class Trial {
 public:
  explicit Trial(const Plan &shared)
      : plan(shared),
        work(*plan.robot),
        plant(*plan.robot, work),
        controller(plan.controller),
        acting(driven(plan, controller)),
        list(&acting),
        loop(plant, &list, plan.t, plan.rtol),
        still(plan.start.size(), 0.0),
        at{plan.t.data(), int(plan.t.size())},
        samples((std::size_t(plan.joints()) + 1) * plan.t.size(), 0.0),
        strip(last_flexible(*plan.robot)),
        end(plan.t.back() - plan.t.front()),
        ticks(long(std::ceil(end * controller.law().rate_Hz - 1e-6))) {
    steps = make_method(plan.method, loop.integration, plan.rtol);
    if (!steps && plan.method != "auto")
      throw std::invalid_argument("there is no method " + plan.method);
  }

  // One row; the fraction of the time that it reached.
  double run(const Prices &prices, const double *gains, double limit, double *figures) {
    controller.set_gains(gains);
    controller.start(acting, plan.start.data());
    loop.most_steps = long(STEPS_A_TICK * end * controller.law().rate_Hz);
    loop.start(plan.start.data(), still.data(), end * FIRST);
    steps = make_method(plan.method, loop.integration, plan.rtol);
    MethodSelection selection(loop, plan.rtol);
    const bool limited = std::isfinite(limit);
    bool lost = false;
    seen = counted = 0, spent = 0;
    std::fill(figures, figures + plan.figures(), 0.0);
    for (bool running = true; running && !lost;) {
      const long some = limited ? LOOK : CALL;
      running = steps ? loop.advance(*steps, some) : selection.advance(some);
      if (!limited) continue;
      sample();
      lost = cost_so_far(prices, limit * CERTAIN, figures) > limit * CERTAIN;
    }
    const RunState &run_state = loop.run_state[0];
    const bool done = run_state.status == Status::done;
    if (done || !lost)
      std::fill(figures, figures + plan.figures(), std::numeric_limits<double>::quiet_NaN());
    if (done) finish(figures);
    return done ? 1.0 : std::fmin((run_state.t - plan.t.front()) / end, 1.0 - 1e-9);
  }

 private:
  const Plan &plan;
  Workspace<double> work;
  ModelPlant<double> plant;
  Controller controller;
  Inputs acting;
  Inputs *list;
  Loop<double> loop;
  std::unique_ptr<Method<double>> steps;  // none: the method is selected
  std::vector<double> still;
  Samples at;
  std::vector<double> samples;  // (N + 1, T): positions of the joints, deflection
  int strip;                    // the link whose deflection it is; -1: none
  double end;
  long ticks;                 // of a whole run
  int seen = 0, counted = 0;  // samples taken; of these, whose cost is counted
  long spent = 0;             // ticks whose effort is counted

  double *row(int i) { return samples.data() + std::size_t(i) * plan.t.size(); }
  const double *reference(int i) const {
    return plan.reference.data() + std::size_t(i) * plan.t.size();
  }

  // Positions and deflection of the rows that the run has since got.
  void sample() {
    const Record &record = loop.record[0];
    for (; seen < record.rows; ++seen) {
      const double *q = record.state.data() + std::size_t(seen) * std::size_t(record.size);
      for (int i = 0; i < plan.joints(); ++i) row(i)[seen] = q[plan.robot->first[std::size_t(i)]];
      row(plan.joints())[seen] = strip < 0 ? 0.0 : bend(*plan.robot, work, q, strip).deflection;
    }
  }

  // Sum of the squares of joint i's outputs over its limit, of the ticks from `begin` to before
  // `end_`.
  double effort(int i, long begin, long end_) const {
    double sum = 0.0;
    const double limit = controller.law().joints[std::size_t(i)].gains.limit;
    if (!std::isfinite(limit)) return sum;
    for (long k = begin; k < end_; ++k) {
      const double u = controller.logged(k, i).output / limit;
      sum += u * u;
    }
    return sum;
  }

  // What the run costs at least, from the samples and ticks so far, which are added to the lower
  // bounds `figures`.
  double cost_so_far(const Prices &prices, double limit, double *figures) {
    const int joints = plan.joints(), vibration = JOINT_FIGURES * joints + VIBRATION;
    const long done = std::min(controller.ticks(), ticks);
    for (int i = 0; i < joints; ++i) {
      if (!controller.owns(i)) continue;
      double *each = figures + JOINT_FIGURES * i;
      joint_so_far(at, reference(i), row(i), counted, seen, each);
      each[EFFORT] += effort(i, spent, done) / double(ticks);
    }
    spent = done, counted = seen;
    double cost = 0.0;
    for (int k = 0; k < JOINT_FIGURES * joints; ++k)
      cost += prices.price[k] * std::fmax(0.0, figures[k] - prices.free[k]);
    if (prices.price[vibration] > 0.0 && cost <= limit)
      figures[vibration] =
          vibration_lower_bound(at, row(joints), seen, (limit - cost) / prices.price[vibration]);
    return cost + prices.price[vibration] * figures[vibration];
  }

  // A finished run's figures: those of each joint, then the strip's.
  void finish(double *figures) {
    sample();
    double settled = 0.0;
    for (int i = 0; i < plan.joints(); ++i) {
      if (!controller.owns(i)) continue;
      double *each = figures + JOINT_FIGURES * i;
      joint_metrics(at, reference(i), row(i), each);
      each[EFFORT] = effort(i, 0, ticks) / double(ticks);
      settled = std::isnan(settled) || std::isnan(each[SETTLING])
                    ? std::numeric_limits<double>::quiet_NaN()
                    : std::fmax(settled, each[SETTLING]);
    }
    strip_metrics(at, row(plan.joints()), settled, figures + JOINT_FIGURES * plan.joints());
  }
};

GainSweep::GainSweep(Plan plan) : plan_(std::move(plan)) {
  take_back(lend());  // (a plan that makes no run is refused here)
}
GainSweep::~GainSweep() = default;

std::unique_ptr<Trial> GainSweep::lend() {
  {
    const std::lock_guard<std::mutex> guard(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Trial> trial = std::move(idle_.back());
      idle_.pop_back();
      return trial;
    }
  }
  return std::make_unique<Trial>(plan_);
}

void GainSweep::take_back(std::unique_ptr<Trial> trial) {
  const std::lock_guard<std::mutex> guard(mutex_);
  idle_.push_back(std::move(trial));
}

void GainSweep::run(const Prices &prices, const double *gains, const double *limits, int rows,
                    int threads, double *figures, double *reached) {
  std::atomic<int> next{0};
  const auto each = [&] {
    std::unique_ptr<Trial> trial = lend();
    for (int b = next++; b < rows; b = next++)
      reached[b] = trial->run(prices, gains + std::ptrdiff_t(b) * plan_.joints() * GAINS, limits[b],
                              figures + std::ptrdiff_t(b) * plan_.figures());
    take_back(std::move(trial));
  };
  std::vector<std::thread> others;
  for (int k = 1; k < std::min(threads, rows); ++k) others.emplace_back(each);
  each();
  for (std::thread &other : others) other.join();
}

}  // namespace flexura
