// The method "auto": the cheapest method is chosen, whatever the robot; what a comparison may not
// do.
#include <atomic>
#include <cmath>
#include <string>

#include "check.hpp"
#include "integration/exponential/exponential.hpp"
#include "integration/runge_kutta/dop853.hpp"
#include "integration/runge_kutta/implicit.hpp"
#include "integration/time_loop.hpp"
#include "plants.hpp"
#include "simulation/method_selection.hpp"
#include "sprung.hpp"

using namespace flexura;

namespace {

std::vector<double> grid(double end, int rows) {
  std::vector<double> t;
  for (int k = 0; k < rows; ++k) t.push_back(end * k / (rows - 1));
  return t;
}

// Passes that a method takes for a run, and its last state.
template <class Advance>
long passes(Plant<double> &plant, Inputs &acting, double end, double rtol, Advance advance,
            std::vector<double> *last = nullptr) {
  Inputs *all[1] = {&acting};
  Loop<double> loop(plant, all, grid(end, 41), rtol);
  std::vector<double> q(std::size_t(plant.n), 0.1), v(std::size_t(plant.n), 0.0);
  loop.start(q.data(), v.data(), 1e-4 * end);
  advance(loop);
  CHECK(loop.run_state[0].status == Status::done);
  const Record &r = loop.record[0];
  CHECK(r.rows == 41);
  for (int k = 0; k < r.rows; ++k) CHECK_NEAR(r.t[std::size_t(k)], end * k / 40, 1e-12);
  if (last) last->assign(r.state.end() - 2 * r.size, r.state.end() - r.size);
  return loop.integration.passes;
}

// What became of a run by "auto" of a plant with joints at 0.1, asked for `some` steps at a time.
struct Ended {
  std::string name;
  RunState state;
  double place;  // of the first joint
};
Ended ended(Plant<double> &plant, Inputs &acting, double end, double rtol,
            const std::atomic<bool> *stop = nullptr, long some = 1000, double first = 1e-4) {
  Inputs *all[1] = {&acting};
  Loop<double> loop(plant, all, grid(end, 5), rtol);
  loop.interrupt = stop;
  std::vector<double> q(std::size_t(plant.n), 0.0), v(std::size_t(plant.n), 0.0);
  for (int i = 0; i < plant.joints; ++i) q[std::size_t(plant.first[std::size_t(i)])] = 0.1;
  loop.start(q.data(), v.data(), first * end);
  MethodSelection selection(loop, rtol);
  CHECK(std::string(selection.name()) == "auto");
  while (selection.advance(some)) {
  }
  return {selection.name(), loop.run_state[0], loop.integration.z[0]};
}

// Holds a force on the first joint: from a time on another one.
struct Held : Sampler {
  double before = 0.0, from = 1e9, after = 0.0;
  void tick(long, double t, const double *, const double *, SampledOutput &held) override {
    held.force[0] = t < from ? before : after;
  }
};

}  // namespace

TEST("under a caller's function: rigid robots, sliders on sleeves, and the others") {
  for (bool rides : {false, true})
    for (int elastic : {0, 1}) {
      Masses<double> plant(1, elastic);
      plant.stiffness[0] = 9.0, plant.viscous[0] = 0.1, plant.rides = rides;
      if (elastic) plant.stiffness[1] = 400.0;
      Inputs acting(1);
      acting.function = [](double, const double *, const double *, double *force) {
        force[0] = 0.9;
      };
      const Ended run = ended(plant, acting, 2.0, 1e-6);
      CHECK(run.state.status == Status::done);
      CHECK_NEAR(run.place, 0.1, 1e-6);  // the spring's force is that of the function
      if (!elastic) CHECK(run.name == "explicit");
      if (elastic && rides) CHECK(run.name == "implicit");
    }
}

TEST("a slider on a sleeve, and sharp tolerances of stiff robots: without exponential steps") {
  for (bool rides : {false, true}) {
    Masses<double> plant = sprung(rides ? 400.0 : 1e14);
    plant.rides = rides;
    Inputs acting(1);
    const Ended run = ended(plant, acting, 1.0, rides ? 1e-5 : 1e-10);
    CHECK(run.state.status == Status::done && run.name != "exponential");
    CHECK_NEAR(run.place, 0.1 * std::cos(3.0), rides ? 1e-4 : 1e-8);
  }
}

TEST("under a controller: by its ticks, the robot's frequencies, dampers and the tolerance") {
  struct {
    double elastic, damper, rate_Hz, rtol;
    const char *name;
  } cases[] = {{100.0, 0.0, 100.0, 1e-5, "explicit-3"},
               {100.0, 0.0, 100.0, 1e-7, "explicit-5"},
               {1e6, 0.0, 10.0, 1e-10, "explicit"},
               {1e8, 2e3, 100.0, 1e-3, "implicit-2"},
               {1e8, 2e3, 100.0, 1e-7, "implicit"},
               {1e6, 0.0, 10.0, 1e-3, ""},
               {1e6, 0.0, 10.0, 1e-7, ""},
               {4e4, 0.0, 100.0, 1e-6, ""}};
  for (const auto &each : cases) {
    Masses<double> plant = sprung(each.elastic, each.damper);
    Held held;
    Inputs acting(1);
    acting.sampler = &held, acting.rate_Hz = each.rate_Hz;
    const Ended run = ended(plant, acting, 1.0, each.rtol);
    CHECK(run.state.status == Status::done);
    if (*each.name) CHECK(run.name == each.name);
    if (each.damper == 0.0) CHECK_NEAR(run.place, 0.1 * std::cos(3.0), 0.1 * std::sqrt(each.rtol));
  }
}

TEST("under a controller: sharp tolerances of stiff robots, rigid ones with a damper") {
  Held held;
  Inputs acting(1);
  acting.sampler = &held, acting.rate_Hz = 10.0;
  Masses<double> stiff = sprung(1e14), rigid(1);
  rigid.stiffness = {1e4}, rigid.viscous[0] = 0.1;
  CHECK(ended(stiff, acting, 1e-4, 1e-10).name == "explicit");
  const Ended run = ended(rigid, acting, 1.0, 1e-5);
  CHECK(run.name == "explicit-3");
  CHECK_NEAR(run.place, 0.1 * std::exp(-0.05) * std::cos(100.0), 1e-3);
}

TEST("several steps of order 2 a tick are left to order 4") {
  Masses<double> plant = sprung(1e8, 2e3);
  Held held;
  Inputs acting(1);
  acting.sampler = &held, acting.rate_Hz = 10.0;
  acting.joints[0].force = {{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 100.0, 60.0, 0.0}};
  CHECK(ended(plant, acting, 0.02, 1e-3).name == "implicit-2");
  CHECK(ended(plant, acting, 60.0, 1e-3).name == "implicit");
}

TEST("runs of any length under a controller or a function end where they should") {
  for (int k = 0; k < 40; ++k)
    for (int by : {0, 1, 2}) {
      const double end = 0.01 * std::pow(1.2, k);
      Masses<double> plant = sprung(by == 2 ? 4e4 : 1e4);
      Held held;
      held.before = 0.9;
      Inputs acting(1);
      if (by)
        acting.sampler = &held, acting.rate_Hz = by == 1 ? 10.0 : 100.0;
      else
        acting.function = [](double, const double *, const double *, double *force) {
          force[0] = 0.9;
        };
      const Ended run = ended(plant, acting, end, 1e-6);
      CHECK(run.state.status == Status::done && run.state.t == end);
      CHECK_NEAR(run.place, 0.1, 1e-5);
    }
}

TEST("where exponential steps get stuck implicit ones begin, again or where it is") {
  for (double force : {1e200, 1e308})
    for (int by : {0, 1, 2}) {  // a signal, a controller, a function
      Masses<double> plant = sprung(1e6);
      Held held;
      held.from = 5.0, held.after = force;
      Inputs acting(1);
      if (by == 0) acting.joints[0].force = {constant(0.0, 0.0), constant(5.0, force)};
      if (by == 1) acting.sampler = &held, acting.rate_Hz = 1.0;
      if (by == 2)
        acting.function = [force](double t, const double *, const double *, double *out) {
          out[0] = t < 5.0 ? 0.0 : force;
        };
      const Ended run = ended(plant, acting, 10.0, 1e-4);
      CHECK(run.state.status == Status::stuck || run.state.status == Status::diverged);
      CHECK_NEAR(run.state.t, 5.0, 1e-3);
      CHECK(run.name == "implicit");
    }
}

TEST("forces that no method can follow, at once: stuck whatever the tolerance") {
  for (double rtol : {1e-4, 1e-10}) {
    Masses<double> plant = sprung(1e6);
    Inputs acting(1);
    acting.function = [](double, const double *q, const double *, double *out) {
      out[0] = 1.0 / std::pow(0.11 - q[0], 3);
    };
    const Ended steep = ended(plant, acting, 10.0, rtol);
    CHECK(steep.state.status == Status::stuck && steep.place < 0.11);
    for (double force : {1e200, 1e308}) {
      Masses<double> plant = sprung(1e14);
      Inputs acting(1);
      acting.joints[0].force = {constant(0.0, force)};
      const Ended run = ended(plant, acting, 1.0, rtol);
      CHECK(run.state.status == Status::stuck || run.state.status == Status::diverged);
    }
  }
}

namespace {

// Stops its run after so many passes.
struct Stopping : Masses<double> {
  std::atomic<bool> stop{false};
  long after;
  explicit Stopping(long count) : Masses<double>(2, 2), after(count) {
    for (int k = 0; k < n; ++k)
      stiffness[std::size_t(k)] = k % 3 ? 1e3 : 0.0, damping[std::size_t(k)] = 300.0,
      gravity[std::size_t(k)] = 5.0;
  }
  void accelerate(const PassInputs<double> &p, double *a, double *reaction) override {
    Masses<double>::accelerate(p, a, reaction);
    stop = asked > after;
  }
};

}  // namespace

TEST("a run that is stopped anywhere, in a comparison too, is stopped") {
  double before = 0.0;
  for (long after = 10; after < 6000; after += 47) {
    Stopping plant(after);
    Inputs acting(2);
    acting.joints[0].force = {{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 1.0, 9.0, 0.0}};
    const Ended run = ended(plant, acting, 1e5, 1e-6, &plant.stop, 100000);
    CHECK(run.state.status == Status::interrupted && run.state.t < 1e5);
    before = std::fmax(before, run.state.t);
  }
  CHECK(before > 0.0);
}

TEST("a limit that is met in a comparison ends the run") {
  for (double at : {0.5, 0.9, 0.99, 0.999})
    for (double damping : {0.0, 300.0}) {
      Masses<double> plant(1, 2);
      plant.stiffness = {0.0, 1e3, 2e3}, plant.damping = {0.0, damping, damping};
      Inputs acting(1);
      acting.joints[0].force = {constant(0.0, -1.0)};
      acting.limit(0, 0.1 - 0.5 * at * at, 1.0);  // q = 0.1 - t^2 / 2
      const Ended run = ended(plant, acting, 1000.0, 1e-6);
      CHECK(run.state.status == Status::limit && run.state.joint == 0);
      CHECK_NEAR(run.state.t, at, 1e-5);
      Masses<double> stiff = sprung(1e14);  // without exponential steps
      stiff.stiffness[0] = 0.0;
      const Ended sharp = ended(stiff, acting, 1000.0, 1e-10);
      CHECK(sharp.state.status == Status::limit && sharp.name == "implicit");
      CHECK_NEAR(sharp.state.t, at, 3e-9);  // limits are wider by 1e-9 m
      acting.limit(0, -1e9, 1e9);           // the run's end, as soon
      const Ended done = ended(stiff, acting, at, 1e-10, nullptr, 1000, 0.5);
      CHECK(done.state.status == Status::done && done.name == "implicit");
      CHECK_NEAR(done.place, 0.1 - 0.5 * at * at, 1e-9);
    }
}

TEST("auto takes at most twice the passes of the cheapest method and 100, and says which") {
  struct {
    double stiff, damping, gravity;
  } robots[] = {{9.0, 0.0, 0.0}, {1e6, 0.0, 5.0}, {1e3, 300.0, 5.0}, {20.0, 1.0, 9.0}};
  for (const auto &robot : robots)
    for (double rtol : {1e-3, 1e-6}) {
      Masses<double> plant(2, 2);
      for (int k = 0; k < 6; ++k)
        plant.stiffness[std::size_t(k)] = k % 3 ? robot.stiff * k : 0.0,
        plant.damping[std::size_t(k)] = robot.damping,
        plant.gravity[std::size_t(k)] = robot.gravity;
      Inputs acting(2);
      acting.joints[0].force = {constant(0.0, 1.0), constant(0.7, -1.0)};
      long least = 1000000000;
      least = std::min(least, passes(plant, acting, 2.0, rtol, [&](Loop<double> &loop) {
                         Exponential<double> m(loop.integration, rtol);
                         while (loop.advance(m, 1000)) {
                         }
                       }));
      least = std::min(least, passes(plant, acting, 2.0, rtol, [&](Loop<double> &loop) {
                         Implicit<double> m(loop.integration);
                         while (loop.advance(m, 1000)) {
                         }
                       }));
      least = std::min(least, passes(plant, acting, 2.0, rtol, [&](Loop<double> &loop) {
                         Explicit<double> m(loop.integration);
                         while (loop.advance(m, 1000)) {
                         }
                       }));
      const char *name = "";
      const long own = passes(plant, acting, 2.0, rtol, [&](Loop<double> &loop) {
        MethodSelection m(loop, rtol);
        while (m.advance(7)) {
        }
        name = m.name();
      });
      std::printf(
          "      stiffness %.0e, damping %.0e, rtol %.0e: auto %ld passes (%s), cheapest %ld\n",
          robot.stiff, robot.damping, rtol, own, name, least);
      CHECK(own <= 2 * least + 100);
    }
}

TEST("auto is deterministic, however its steps are asked for") {
  Masses<double> plant(2, 2);
  for (int k = 0; k < 6; ++k)
    plant.stiffness[std::size_t(k)] = k % 3 ? 400.0 * k : 0.0, plant.gravity[std::size_t(k)] = 9.0;
  Inputs acting(2);
  std::vector<double> one, other;
  passes(
      plant, acting, 2.0, 1e-5,
      [&](Loop<double> &loop) {
        MethodSelection m(loop, 1e-5);
        while (m.advance(1000)) {
        }
      },
      &one);
  passes(
      plant, acting, 2.0, 1e-5,
      [&](Loop<double> &loop) {
        MethodSelection m(loop, 1e-5);
        while (m.advance(7)) {
        }
      },
      &other);
  CHECK(one == other);
}

TEST(
    "a caller's function is never asked about a time before one that it has seen by more than a "
    "step") {
  Masses<double> plant(1, 1);
  plant.stiffness[1] = 100.0;
  Inputs acting(1);
  double latest = 0.0, back = 0.0;
  acting.function = [&](double t, const double *, const double *, double *force) {
    back = std::fmax(back, latest - t), latest = std::fmax(latest, t);
    force[0] = std::sin(3.0 * t);
  };
  passes(plant, acting, 2.0, 1e-5, [&](Loop<double> &loop) {
    MethodSelection m(loop, 1e-5);
    while (m.advance(1000)) {
    }
  });
  CHECK(back < 0.2);
}
