// The method "auto": the cheapest method is chosen, whatever the robot; what a comparison may not
// do.
#include <cmath>

#include "check.hpp"
#include "integration/exponential/exponential.hpp"
#include "integration/runge_kutta/dop853.hpp"
#include "integration/runge_kutta/implicit.hpp"
#include "integration/time_loop.hpp"
#include "plants.hpp"
#include "simulation/method_selection.hpp"

using namespace flexura;

namespace {

Segment constant(double t0, double value) {
  return {t0, {value, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}

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

}  // namespace

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
