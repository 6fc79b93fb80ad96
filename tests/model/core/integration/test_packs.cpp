// The time loop of packs: each robot has the digits that it has alone, and its own end.
#include <atomic>

#include "integration/runge_kutta/embedded_pairs.hpp"
#include "loop_runs.hpp"

using namespace flexura;

TEST("a pack gives each robot the digits that it has alone") {
  for (bool implicit : {false, true}) {
    Masses<Pack<4>> four(1, 1);
    std::vector<Inputs> acting(4, Inputs(1));
    std::vector<Recorder> recorder(4);
    Inputs *list[4];
    std::vector<double> q{0.3, 0.1, -0.4, 0.7};
    Pack<4> q0[2], v0[2] = {Pack<4>(0.0), Pack<4>(0.2)};
    for (int k = 0; k < 4; ++k) {
      acting[k].joints[0].force = {segment(0.0, 1.0 + k), segment(0.2 + 0.05 * k, -1.0)};
      if (k == 2) acting[k].sampler = &recorder[k], acting[k].rate_Hz = 7.0, recorder[k].gain = 5.0;
      if (k == 3) acting[k].low[0] = 0.2;
      list[k] = &acting[k];
      four.stiffness[0].set(k, 4.0 + k), four.stiffness[1].set(k, 100.0 * (1 + k)),
          four.damping[1].set(k, 0.1 * k);
      four.coulomb[0].set(k, k == 1 ? 0.2 : 0.0), four.gravity[0].set(k, k);
      q0[0].set(k, q[k]), q0[1].set(k, 0.1);
    }
    for (auto *x : {&four.damping[0], &four.gravity[1]}) *x = Pack<4>(0.0);
    Loop<Pack<4>> loop(four, list, grid(0.0, 2.0, 21), 1e-6);
    std::unique_ptr<Method<Pack<4>>> method;
    if (implicit)
      method = std::make_unique<Implicit<Pack<4>>>(loop.integration);
    else
      method = std::make_unique<Explicit<Pack<4>>>(loop.integration);
    loop.start(q0, v0, 1e-3);
    while (loop.advance(*method, 100)) {
    }
    for (int k = 0; k < 4; ++k) {
      Masses<double> one(1, 1);
      for (int j = 0; j < 2; ++j) {
        one.stiffness[j] = four.stiffness[j][k], one.damping[j] = four.damping[j][k],
        one.gravity[j] = four.gravity[j][k];
      }
      one.coulomb[0] = four.coulomb[0][k];
      Inputs alone(1);
      Recorder own;
      alone.joints = acting[k].joints, alone.low = acting[k].low, alone.rate_Hz = acting[k].rate_Hz;
      if (acting[k].sampler) own.gain = 5.0, alone.sampler = &own;
      Run run(one, alone, grid(0.0, 2.0, 21), 1e-6, implicit);
      CHECK(run({q[k], 0.1}, {0.0, 0.2}) == loop.run_state[k].status);
      CHECK(run.loop.run_state[0].status == (k == 3 ? Status::limit : Status::done));
      CHECK(run.record().rows == loop.record[k].rows &&
            run.loop.run_state[0].steps == loop.run_state[k].steps);
      bool same = true;
      for (std::size_t j = 0;
           j < static_cast<std::size_t>(loop.record[k].rows * loop.record[k].size); ++j)
        same = same && check::same_bits(run.record().state[j], loop.record[k].state[j]);
      for (std::size_t j = 0; j < static_cast<std::size_t>(loop.record[k].rows); ++j)
        same = same && check::same_bits(run.record().drive[j], loop.record[k].drive[j]);
      CHECK(same);
    }
  }
}

TEST("masses of a pack whose stages are refused at walls have the digits of each alone") {
  std::vector<Inputs> acting(4, Inputs(1));
  Inputs *list[4];
  for (int k = 0; k < 4; ++k) {
    acting[std::size_t(k)].joints[0].force = {segment(0.0, 1.0 + 0.3 * k)};
    list[k] = &acting[std::size_t(k)];
    if (k == 2) continue;  // one has no wall
    acting[std::size_t(k)].function = [k](double, const double *q, const double *v, double *force) {
      const double deep = q[0] - 0.1 * (k + 1);
      if (deep > 0.0) force[0] = -1e7 * deep * deep - 1e5 * deep * v[0];
    };
  }
  Masses<Pack<4>> four(1);
  four.coulomb = {0.1};
  Loop<Pack<4>> loop(four, list, grid(0.0, 2.0, 11), 1e-3);
  Implicit<Pack<4>> method(loop.integration);
  const Pack<4> still[1] = {0.0};
  loop.start(still, still, 0.1);
  while (loop.advance(method, 100)) {
  }
  for (int k = 0; k < 4; ++k) {
    Masses<double> plant(1);
    plant.coulomb = {0.1};
    Run run(plant, list[k], grid(0.0, 2.0, 11), 1e-3, true);
    CHECK(run({0.0}, {0.0}, 0.1) == Status::done);
    const RunState &alone = run.loop.run_state[0], &packed = loop.run_state[std::size_t(k)];
    CHECK(alone.steps == packed.steps && alone.rejected == packed.rejected);
    bool same = true;
    for (std::size_t j = 0; j < std::size_t(11 * run.record().size); ++j)
      same = same && check::same_bits(run.record().state[j], loop.record[std::size_t(k)].state[j]);
    CHECK(same);
    CHECK((run.at(10, 0) > 1.0) == (k == 2));
  }
}

TEST("a pack that is stopped keeps the robots that ended; its slowest robot is its progress") {
  std::vector<Inputs> acting(4, Inputs(1));
  Inputs *list[4];
  for (int k = 0; k < 4; ++k) {
    acting[std::size_t(k)].joints[0].force = {segment(0.0, 1.0 + k)};
    list[k] = &acting[std::size_t(k)];
  }
  acting[3].high[0] = 0.02;  // met at 0.1 s
  Masses<Pack<4>> four(1);
  std::atomic<bool> stop{false};
  std::atomic<double> reached{-1.0};
  Loop<Pack<4>> loop(four, list, grid(0.0, 10.0, 11), 1e-6);
  loop.longest = 0.05, loop.interrupt = &stop, loop.progress = &reached;
  Explicit<Pack<4>> method(loop.integration);
  const Pack<4> still[1] = {0.0};
  loop.start(still, still, 1e-3);
  while (loop.run_state[3].running()) loop.advance(method, 1);
  loop.rehearsal = true;
  CHECK(loop.advance(method, 20));
  loop.rehearsal = false;
  double slowest = 10.0;
  for (int k = 0; k < 3; ++k) slowest = std::fmin(slowest, loop.run_state[std::size_t(k)].t);
  CHECK(reached == slowest && slowest > 0.1);
  stop = true;
  CHECK(!loop.advance(method, 20));
  CHECK(loop.run_state[3].status == Status::limit);
  CHECK_NEAR(loop.run_state[3].t, 0.1, 1e-9);
  for (std::size_t k = 0; k < 3; ++k) CHECK(loop.run_state[k].status == Status::interrupted);
}

TEST("steps of a pair in a pack have the digits of each robot alone, where each has breaks") {
  std::vector<Inputs> acting(4, Inputs(1));
  Inputs *list[4];
  for (int k = 0; k < 4; ++k) {
    acting[std::size_t(k)].joints[0].force = {segment(0.0, 1.0), segment(0.2 + 0.1 * k, -1.0)};
    list[k] = &acting[std::size_t(k)];
  }
  for (const EmbeddedPair *pair : {&PAIR_3, &PAIR_5}) {
    Masses<Pack<4>> four(1, 1);
    four.stiffness = {4.0, 90.0};
    Loop<Pack<4>> loop(four, list, grid(0.0, 1.0, 6), 1e-6);
    EmbeddedPairSteps<Pack<4>> method(loop.integration, *pair);
    const Pack<4> q[2] = {0.1, 0.1}, v[2] = {0.0, 0.0};
    loop.start(q, v, 1e-3);
    while (loop.advance(method, 100)) {
    }
    for (int k = 0; k < 4; ++k) {
      Masses<double> plant(1, 1);
      plant.stiffness = {4.0, 90.0};
      Run run(plant, list[k], grid(0.0, 1.0, 6), 1e-6, false);
      run.method = std::make_unique<EmbeddedPairSteps<double>>(run.loop.integration, *pair);
      CHECK(run({0.1, 0.1}, {0.0, 0.0}) == Status::done);
      bool same = run.record().rows == 6 && loop.record[std::size_t(k)].rows == 6;
      for (std::size_t j = 0; same && j < std::size_t(6 * run.record().size); ++j)
        same = check::same_bits(run.record().state[j], loop.record[std::size_t(k)].state[j]);
      CHECK(same);
    }
  }
}
