#include "simulation/population.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>

#include "control/model_plant.hpp"
#include "dynamics/places/outputs.hpp"
#include "integration/time_loop.hpp"
#include "link/assembly.hpp"
#include "robot/input_fault.hpp"
#include "simulation/first_steps.hpp"
#include "simulation/method_by_name.hpp"
#include "simulation/method_selection.hpp"
#include "simulation/simulation.hpp"

namespace flexura {
namespace {

using Four = Pack<4>;
constexpr int LANES = 4;
constexpr long STEPS = 1000;  // between two looks at whether a robot still runs

// A robot that is about to run.
struct Starter {
  int robot = 0;  // number in the population
  std::shared_ptr<const Model<double>> shared;
  Inputs acting;
  std::string method;
  bool open = false;  // "auto": the run goes on alone unless FirstSteps settles its method
  std::vector<double> q, v;
  const Model<double> &model() const { return *shared; }
};

// How a robot's run went.
struct Ran {
  const RunState *run_state;
  const Record *record;
  std::vector<double> q;  // where it ended
  std::string method;
};

// Whether two robots of one table, which has the same joints and unknowns for all, can share a
// pack: their lines have as many points, too.
bool alike(const Starter &a, const Starter &b) {
  const Model<double> &p = a.model(), &q = b.model();
  bool out = a.method == b.method && p.mass_damped == q.mass_damped;
  for (std::size_t i = 0; out && i < p.pieces.size(); ++i) out = p.pieces[i].P == q.pieces[i].P;
  for (std::size_t i = 0; out && i < a.acting.joints.size(); ++i) {
    const JointDrive &one = a.acting.joints[i], &other = b.acting.joints[i];
    out = (one.prescribed && one.follows()) == (other.prescribed && other.follows());
  }
  return out;
}

// One to four models as a pack; lanes without a robot have the first again.
Model<Four> side_by_side(const std::vector<const Model<double> *> &models) {
  const Model<double> *four[LANES];
  for (std::size_t k = 0; k < LANES; ++k) four[k] = models[k < models.size() ? k : 0];
  return pack(four);
}

class Worker {
 public:
  Worker(const Population &population, double *values, const std::atomic<bool> &stop,
         std::vector<Ending> &endings)
      : all_(population), values_(values), stop_(stop), endings_(endings) {
    for (const Channel &channel : all_.channels)
      balanced_ = balanced_ || channel.of == Channel::account;
  }

  // Robots `first` to `end`, at most four.
  void run(int first, int end) {
    std::vector<Robot> robots;
    const Robot *pointers[LANES];
    Model<double> models[LANES];
    std::unique_ptr<Fault> faults[LANES];
    for (int k = first; k < end; ++k) robots.push_back(robot_of(all_.robots, k));
    for (int k = 0; k < end - first; ++k) pointers[k] = &robots[std::size_t(k)];
    assemble(pointers, end - first, models, faults);
    std::vector<Starter> starters;
    for (int k = first; k < end; ++k) {
      Ending &ending = endings_[std::size_t(k)];
      if (const Fault *fault = faults[k - first].get()) {
        ending.refusal = Ending::fault, ending.joint = fault->link, ending.key = fault->key,
        ending.text = fault->what();
        continue;
      }
      Starter starter = ready(k, std::move(models[k - first]));
      if (!inside_limits(starter, ending)) continue;
      if (starter.method == "auto" || !starter.acting.loads.empty())
        run_alone(starter);
      else
        starters.push_back(std::move(starter));
    }
    while (!starters.empty()) {  // those like the first share a pack
      std::vector<Starter> rest, together;
      for (Starter &s : starters)
        (together.empty() || alike(together.front(), s) ? together : rest).push_back(std::move(s));
      run_together(together);
      starters = std::move(rest);
    }
  }

 private:
  const Population &all_;
  double *values_;
  const std::atomic<bool> &stop_;
  std::vector<Ending> &endings_;
  bool balanced_ = false;  // are accounts asked for?

  Starter ready(int k, Model<double> model) const {
    Starter out;
    out.robot = k, out.method = all_.method,
    out.acting = all_.drives[std::size_t(all_.drive_of[std::size_t(k)])];
    const std::size_t n = std::size_t(model.n);
    const bool own = all_.q.empty(), each = all_.q.size() == std::size_t(all_.robots.count) * n;
    if ((!own && !each && all_.q.size() != n) || (!all_.v.empty() && all_.v.size() != n))
      throw std::invalid_argument("the start needs an entry an unknown");
    out.q.assign(n, 0.0), out.v.assign(n, 0.0);
    if (!own)
      std::copy_n(all_.q.begin() + (each ? std::ptrdiff_t(std::size_t(k) * n) : 0), n,
                  out.q.begin());
    std::copy(all_.v.begin(), all_.v.end(), out.v.begin());
    for (int i = 0; i < model.links(); ++i) {
      const std::size_t link = std::size_t(i), row = std::size_t(model.first[link]);
      const double *limits = all_.limits + 2 * (std::size_t(k) * model.first.size() + link);
      out.acting.limit(i, limits[0], limits[1]);
      if (own) out.q[row] = model.start[link];
      if (model.locked[link]) out.v[row] = 0.0;
      const JointDrive &drive = out.acting.joints[link];
      if (!drive.prescribed || !drive.follows()) continue;
      const Motion motion = out.acting.motion(i, all_.times.front());
      out.q[row] = motion.y, out.v[row] = motion.yd;
    }
    if (all_.method == "auto" && out.acting.loads.empty()) choose_method(model, out);
    out.shared = std::make_shared<const Model<double>>(std::move(model));
    return out;
  }

  // The method that needs no trial, or the exponential steps that a trial begins with. A sharp
  // tolerance has a trial without them: "auto" remains, and the robot runs alone.
  void choose_method(const Model<double> &model, Starter &starter) const {
    Workspace<double> work(model);
    ModelPlant<double> plant(model, work);
    Inputs *acting = &starter.acting;
    Integration<double> run(plant, &acting, all_.rtol);
    std::copy(starter.q.begin(), starter.q.end(), run.z.begin());
    std::copy(starter.v.begin(), starter.v.end(), run.z.begin() + model.n);
    const char *name = method_without_trial(run, all_.times.front(), all_.rtol);
    starter.open = name == nullptr && all_.rtol >= SHARPEST;
    if (starter.open) name = "exponential";
    if (name) starter.method = name;
  }

  static bool inside_limits(const Starter &starter, Ending &ending) {
    const Model<double> &model = starter.model();
    for (std::size_t i = 0; i < model.first.size(); ++i) {
      const double place = starter.q[std::size_t(model.first[i])];
      ending.position.push_back(place);
      if (ending.refusal != Ending::none || (model.low[i] <= place && place <= model.high[i]))
        continue;
      ending.refusal = Ending::start, ending.joint = int(i);
    }
    return ending.refusal == Ending::none;
  }

  // Robots that are alike, as one pack; one whose method is found within the run goes alone after
  // that.
  void run_together(std::vector<Starter> &starters) {
    const int count = int(starters.size());
    auto starter = [&](int k) -> Starter & {
      return starters[std::size_t(k < count ? k : 0)];
    };  // lanes without a robot run the first again
    std::vector<const Model<double> *> models;
    for (const Starter &each : starters) models.push_back(each.shared.get());
    const Model<Four> model = side_by_side(models);
    Inputs *acting[LANES];
    const std::size_t n = std::size_t(model.n);
    std::vector<Four> q(n), v(n);
    for (int k = 0; k < LANES; ++k) {
      acting[k] = &starter(k).acting;
      for (std::size_t i = 0; i < n; ++i)
        q[i].set(k, starter(k).q[i]), v[i].set(k, starter(k).v[i]);
    }
    Workspace<Four> work(model);
    ModelPlant<Four> plant(model, work);
    Loop<Four> loop(plant, acting, all_.times, all_.rtol);
    const auto method =
        make_method<Four>(starter(0).method, loop.integration, all_.rtol, {all_.numerical_damping});
    if (!method) throw std::invalid_argument("there is no method " + all_.method);
    loop.interrupt = &stop_, loop.integration.balanced = balanced_;
    if (all_.most_steps > 0) loop.most_steps = all_.most_steps;
    loop.start(q.data(), v.data(), FIRST_STEP * (all_.times.back() - all_.times.front()));
    std::array<FirstSteps, LANES> pace;
    for (bool more = starter(0).open && !plant.rides; more && loop.advance(*method, 1);) {
      more = false;
      for (std::size_t k = 0; k < LANES; ++k) more |= pace[k].look(loop.run_state[k]);
    }
    std::array<bool, LANES> alone{};
    for (std::size_t k = 0; k < std::size_t(count) && starter(0).open; ++k) {
      const RunState &run_state = loop.run_state[k];
      alone[k] =
          plant.rides || !(pace[k].settled(run_state) ||
                           (run_state.running() &&
                            !outdone(starters[k], pace[k].speed(run_state), run_state.wish)));
    }
    for (std::size_t k = 0; k < LANES; ++k)
      if (alone[k < std::size_t(count) ? k : 0]) loop.run_state[k].status = Status::interrupted;
    while (loop.advance(*method, STEPS)) {
    }
    std::vector<Ran> ran;
    std::vector<int> robots;
    std::vector<const Model<double> *> of;
    for (int k = 0; k < count; ++k) {
      const RunState &run_state = loop.run_state[std::size_t(k)];
      const bool failed = run_state.status == Status::stuck || run_state.status == Status::diverged;
      if (alone[std::size_t(k)] || (starter(0).open && (failed || FirstSteps::attempts(run_state) >
                                                                      MethodSelection::AGAIN))) {
        run_alone(starter(k));
        continue;
      }
      ran.push_back({&run_state, &loop.record[std::size_t(k)], {}, method->name()});
      for (std::size_t i = 0; i < n; ++i) ran.back().q.push_back(loop.integration.z[i][k]);
      robots.push_back(starter(k).robot), of.push_back(models[std::size_t(k)]);
    }
    if (int(ran.size()) == count)
      finish(model, robots, ran);
    else if (!ran.empty())
      finish(side_by_side(of), robots, ran);
  }

  Request request_of(const Starter &starter) const {
    Request request;
    request.times = all_.times, request.q = starter.q, request.v = starter.v,
    request.rtol = all_.rtol, request.method = all_.method;
    request.most_steps = all_.most_steps, request.numerical_damping = all_.numerical_damping;
    return request;
  }

  // Does another method get further than the exponential steps that a pack has begun with?
  bool outdone(const Starter &starter, double speed, double step) const {
    return Simulation(starter.shared, starter.acting, request_of(starter)).outdone(speed, step);
  }

  void run_alone(const Starter &starter) {
    Simulation run(starter.shared, starter.acting, request_of(starter));
    while (run.advance(STEPS) && !stop_.load(std::memory_order_relaxed)) {
    }
    finish(side_by_side({starter.shared.get()}), {starter.robot},
           {{&run.run_state(), &run.record(), run.state(), run.method()}});
  }

  // How robots ended, and their channels. A row of times that a robot has not reached shows its
  // first one and is not written.
  void finish(const Model<Four> &model, const std::vector<int> &robots,
              const std::vector<Ran> &ran) {
    const int n = model.n, count = int(robots.size()), size = 2 * n + ACCOUNTS;
    for (int k = 0; k < count; ++k)
      end(model, ran[std::size_t(k)], endings_[std::size_t(robots[std::size_t(k)])]);
    Observer<Four> observer(model, all_.stations);
    balance(observer, n, robots, ran);
    int parts = 0, most = 0, rows[LANES];
    for (const Channel &channel : all_.channels)
      parts |= channel.of == Channel::seen ? observer.part_of(channel.index) : 0;
    auto record = [&](int k) -> const Record & {
      return *ran[std::size_t(k < count ? k : 0)].record;
    };
    for (int k = 0; k < LANES; ++k)
      rows[k] = k < count ? reached(record(k)) : 0, most = std::max(most, rows[k]);
    std::vector<Four> state(static_cast<std::size_t>(2 * n)),
        seen(static_cast<std::size_t>(observer.columns()));
    for (int row = 0; row < most; ++row) {
      const double *z[LANES], *drive[LANES];
      for (int k = 0; k < LANES; ++k) {
        const std::size_t at = row < rows[k] ? std::size_t(row) : 0;
        z[k] = record(k).state.data() + at * std::size_t(size),
        drive[k] = record(k).drive.data() + at * std::size_t(record(k).joints);
        for (int j = 0; j < 2 * n; ++j) state[std::size_t(j)].set(k, z[k][j]);
      }
      if (parts != 0) observer.observe(state.data(), state.data() + n, seen.data(), parts);
      for (std::size_t c = 0; c < all_.channels.size(); ++c)
        for (int k = 0; k < count; ++k)
          if (row < rows[k])
            *value(c, robots[std::size_t(k)], row) =
                number(all_.channels[c], model, z[k], drive[k], seen, k);
    }
  }

  // (102) at the ends of robots that are done: by how much their energies and accounts do not
  // balance, relative to the largest of them at LOOKS rows.
  void balance(Observer<Four> &observer, int n, const std::vector<int> &robots,
               const std::vector<Ran> &ran) const {
    constexpr int LOOKS = 5, KINDS = 3;  // kinetic, strain, potential
    const std::size_t count = robots.size(), size = std::size_t(2 * n + ACCOUNTS),
                      energies = std::size_t(observer.columns() - KINDS);
    std::vector<Four> state(std::size_t(2 * n)), seen(std::size_t(observer.columns()));
    const double *z[LANES] = {};
    double first[LANES][KINDS] = {}, last[LANES][KINDS] = {}, scale[LANES] = {};
    for (int look = 0; look < LOOKS; ++look) {
      for (std::size_t k = 0; k < LANES; ++k) {
        const Record &record = *ran[k < count ? k : 0].record;
        if (record.rows == 0) return;
        z[k] = record.state.data() + std::size_t((record.rows - 1) * look / (LOOKS - 1)) * size;
        for (std::size_t j = 0; j < state.size(); ++j) state[j].set(int(k), z[k][j]);
      }
      observer.observe(state.data(), state.data() + n, seen.data(), Observer<Four>::ENERGIES);
      for (std::size_t k = 0; k < LANES; ++k)
        for (std::size_t e = 0; e < KINDS; ++e) {
          last[k][e] = seen[energies + e][int(k)];
          if (look == 0) first[k][e] = last[k][e];
          scale[k] = std::fmax(
              scale[k], std::fmax(std::fabs(last[k][e]), std::fabs(last[k][e] - first[k][e])));
        }
    }
    for (std::size_t k = 0; k < count; ++k) {
      if (ran[k].run_state->status != Status::done) continue;
      const double *account = z[k] + 2 * n;
      double missing = account[LOSS] + account[NUMERICAL] - account[WORK];
      for (std::size_t e = 0; e < KINDS; ++e) missing += last[k][e] - first[k][e];
      const double strain = last[k][1] - first[k][1] - account[STRAIN];
      for (int of : {WORK, LOSS, NUMERICAL}) scale[k] = std::fmax(scale[k], std::fabs(account[of]));
      const double whole = larger(std::fabs(missing), std::fabs(strain));
      endings_[std::size_t(robots[k])].balance = whole / std::fmax(scale[k], 1e-300);
    }
  }

  void end(const Model<Four> &model, const Ran &ran, Ending &ending) const {
    const RunState &run_state = *ran.run_state;
    const Record &record = *ran.record;
    ending.status = run_state.status, ending.reached = run_state.t, ending.joint = run_state.joint,
    ending.steps = run_state.steps;
    if (run_state.status != Status::done) ending.text = explain(run_state, ran.method, all_.rtol);
    for (std::size_t i = 0; i < ending.position.size(); ++i) {
      const std::size_t row = std::size_t(model.first[i]);
      const bool last = run_state.status == Status::limit &&
                        record.rows > 0;  // the state there is the record's last row
      ending.position[i] =
          last ? record.state[std::size_t(record.rows - 1) * std::size_t(record.size) + row]
               : ran.q[row];
    }
  }

  static double number(const Channel &channel, const Model<Four> &model, const double *z,
                       const double *drive, const std::vector<Four> &seen, int k) {
    const std::size_t i = std::size_t(channel.index);
    switch (channel.of) {
      case Channel::position: return hub_position(model, channel.index, z);
      case Channel::velocity: return hub_position(model, channel.index, z + model.n);
      case Channel::motor_position: return z[model.first[i]];
      case Channel::motor_velocity: return z[model.n + model.first[i]];
      case Channel::drive: return drive[i];
      case Channel::account: return z[2 * model.n + channel.index];
      case Channel::seen: return seen[i][k];
    }
    return 0.0;
  }

  double *value(std::size_t channel, int robot, int row) const {
    return values_ +
           (channel * std::size_t(all_.robots.count) + std::size_t(robot)) * all_.times.size() +
           std::size_t(row);
  }

  // Rows of a record that are outputs; after a limit one more follows.
  int reached(const Record &record) const {
    const int most = std::min(record.rows, int(all_.times.size()));
    int row = 0;
    while (row < most && record.t[std::size_t(row)] == all_.times[std::size_t(row)]) ++row;
    return row;
  }
};

}  // namespace

std::vector<Ending> run(const Population &population, int threads, double *values,
                        const std::atomic<bool> &stop, std::atomic<long> &done) {
  const int robots = population.robots.count;
  std::vector<Ending> endings(static_cast<std::size_t>(robots));
  std::fill_n(values, population.channels.size() * std::size_t(robots) * population.times.size(),
              std::numeric_limits<double>::quiet_NaN());
  std::atomic<int> next{0};
  std::mutex lock;
  std::exception_ptr failure;
  auto work = [&] {
    try {
      Worker worker(population, values, stop, endings);
      for (int first;
           (first = next.fetch_add(LANES)) < robots && !stop.load(std::memory_order_relaxed);) {
        const int end = std::min(first + LANES, robots);
        worker.run(first, end);
        done.fetch_add(end - first, std::memory_order_relaxed);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> guard(lock);
      failure = std::current_exception(), next = robots;
    }
  };
  std::vector<std::thread> others;
  for (int k = 1; k < std::min(threads, (robots + LANES - 1) / LANES); ++k)
    others.emplace_back(work);
  work();
  for (std::thread &other : others) other.join();
  if (failure) std::rethrow_exception(failure);
  return endings;
}

}  // namespace flexura
