// Runs of one robot by the time loop, for its tests.
#pragma once
#include <memory>

#include "check.hpp"
#include "integration/runge_kutta/dop853.hpp"
#include "integration/runge_kutta/implicit.hpp"
#include "integration/time_loop.hpp"
#include "plants.hpp"

namespace flexura {

inline std::vector<double> grid(double from, double to, int count) {
  std::vector<double> t;
  for (int k = 0; k < count; ++k) t.push_back(from + (to - from) * k / (count - 1));
  return t;
}
inline Segment segment(double t0, double c0, double c1 = 0.0) {
  return {t0, {c0, c1, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}

// One robot's run, with the method that the test names.
struct Run {
  Loop<double> loop;
  std::unique_ptr<Method<double>> method;
  Run(Plant<double> &plant, Inputs &acting, std::vector<double> t, double rtol, bool implicit)
      : Run(plant, &acting, std::move(t), rtol, implicit) {}
  Run(Plant<double> &plant, Inputs *acting, std::vector<double> t, double rtol, bool implicit)
      : loop(plant, &acting, std::move(t), rtol) {
    if (implicit)
      method = std::make_unique<Implicit<double>>(loop.integration);
    else
      method = std::make_unique<Explicit<double>>(loop.integration);
  }
  Status operator()(std::vector<double> q, std::vector<double> v, double first = 1e-3) {
    loop.start(q.data(), v.data(), first);
    while (loop.advance(*method, 100)) {
    }
    return loop.run_state[0].status;
  }
  const Record &record() const { return loop.record[0]; }
  double at(int row, int k) const {
    return record().state[static_cast<std::size_t>(row * record().size + k)];
  }
  double account(int row, Account which) const { return at(row, record().size - ACCOUNTS + which); }
  double drive(int row, int i) const {
    return record().drive[static_cast<std::size_t>(row * record().joints + i)];
  }
};

// A controller that remembers what it was called for.
struct Recorder : Sampler {
  std::vector<double> t, place;
  double gain = 0.0;
  void tick(long k, double now, const double *q, const double *v, SampledOutput &held) override {
    CHECK(k == static_cast<long>(t.size()));
    t.push_back(now), place.push_back(q[0]);
    held.force[0] = -gain * q[0] - 0.1 * gain * v[0];
  }
};

}  // namespace flexura
