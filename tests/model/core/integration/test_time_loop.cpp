// The time loop and its methods, on plants whose motion is known.
#include "integration/runge_kutta/embedded_pairs.hpp"
#include "loop_runs.hpp"

using namespace flexura;

namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();

// The error at t = 1 of `count` equal steps of q'' + q = 0 from q = 1.
template <class M, class... Arguments>
double oscillator_error(int count, const Arguments &...more) {
  Masses<double> plant(1);
  plant.stiffness[0] = 1.0;
  Inputs acting(1);
  Inputs *list = &acting;
  Integration<double> c(plant, &list, 1e-8);
  M method(c, more...);
  c.z[0] = 1.0;
  c.weights.start(c.z.data());
  const double h = 1.0 / count;
  method.begin(1.0, 0.0);
  for (int k = 0; k < count; ++k) {
    method.attempt(k * h, h, INFINITE);
    method.accept(1.0);
    c.z = c.znew;
  }
  return std::hypot(c.z[0] - std::cos(1.0), c.z[1] + std::sin(1.0));
}

template <class M, class... Arguments>
double order(int coarse, const Arguments &...more) {
  return std::log2(oscillator_error<M>(coarse, more...) / oscillator_error<M>(2 * coarse, more...));
}

}  // namespace

TEST("steps have the order that is theirs") {
  CHECK_NEAR(order<Explicit<double>>(2), 8.0, 0.5);
  CHECK_NEAR(order<Implicit<double>>(32), 4.0, 0.3);
  CHECK_NEAR(order<EmbeddedPairSteps<double>>(16, PAIR_3), 3.0, 0.2);
  CHECK_NEAR(order<EmbeddedPairSteps<double>>(8, PAIR_5), 5.0, 0.3);
}

TEST("an oscillator, at outputs between steps") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1, 1);
    plant.stiffness = {4.0, 9.0};
    Inputs acting(1);
    Run run(plant, acting, grid(0.0, 10.0, 1001), implicit ? 1e-7 : 1e-9, implicit);
    CHECK(run({1.0, 0.5}, {0.0, 0.0}) == Status::done);
    CHECK(run.record().rows == 1001);
    double worst_place = 0.0, worst_rate = 0.0;
    for (int k = 0; k < 1001; ++k) {
      const double t = run.record().t[static_cast<std::size_t>(k)];
      worst_place = std::fmax(worst_place, std::fabs(run.at(k, 0) - std::cos(2.0 * t)));
      worst_place = std::fmax(worst_place, std::fabs(run.at(k, 1) - 0.5 * std::cos(3.0 * t)));
      worst_rate = std::fmax(worst_rate, std::fabs(run.at(k, 2) + 2.0 * std::sin(2.0 * t)));
    }
    const double most = implicit ? 2e-5 : 1e-7;
    CHECK_NEAR(worst_place, 0.0, most);
    CHECK_NEAR(worst_rate, 0.0, 5.0 * most);
  }
}

TEST("work, loss and strain are integrals of their own, and make the balance") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1, 1);
    plant.stiffness = {4.0, 9.0}, plant.damping = {0.0, 0.3}, plant.viscous = {0.2},
    plant.coulomb = {0.1};
    Inputs acting(1);
    acting.joints[0].force = {{0.0, {1.0, 0.5, 0.0, 0.0, 0.0, 0.0}, 2.0, 5.0, 0.3}};
    acting.joints[0].motion = {{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.5, 3.0, 0.0}};
    acting.joints[0].kp = 20.0, acting.joints[0].kd = 1.0;
    Run run(plant, acting, grid(0.0, 3.0, 31), 1e-6, implicit);
    CHECK(run({0.2, 0.5}, {0.0, 0.1}) == Status::done);
    auto energy = [&](int row, bool strain_only) {
      double sum = 0.0;
      for (int k = 0; k < 2; ++k) {
        sum += 0.5 * plant.stiffness[static_cast<std::size_t>(k)] * run.at(row, k) * run.at(row, k);
        if (!strain_only) sum += 0.5 * run.at(row, 2 + k) * run.at(row, 2 + k);
      }
      return sum;
    };
    for (int k = 1; k < 31; ++k) {
      const double rise = energy(k, false) - energy(0, false);
      CHECK_NEAR(run.account(k, WORK) - run.account(k, LOSS) - rise, 0.0, 1e-4);
      CHECK_NEAR(run.account(k, STRAIN) - (energy(k, true) - energy(0, true)), 0.0, 1e-3);
    }
    CHECK(run.account(30, LOSS) > 0.1);
    CHECK_NEAR(run.account(30, NUMERICAL), 0.0, 0.0);
  }
}

TEST("a stiff spring costs implicit steps nothing, and limits explicit ones") {
  Masses<double> plant(1, 1);
  plant.stiffness = {4.0, 1e8};
  Inputs acting(1);
  Run implicit(plant, acting, grid(0.0, 5.0, 11), 1e-5, true),
      run(plant, acting, grid(0.0, 5.0, 11), 1e-5, false);
  CHECK(implicit({1.0, 0.0}, {0.0, 0.0}) == Status::done);
  CHECK(implicit.loop.integration.passes < 4000);
  CHECK_NEAR(implicit.at(10, 0), std::cos(10.0), 1e-3);
  CHECK(run({1.0, 0.0}, {0.0, 0.0}) == Status::done);
  CHECK(run.loop.run_state[0].steps > static_cast<long>(5.0 * 1e4 / 5.3));
  CHECK(run.loop.run_state[0].rejected < 5);
}

TEST("a sampled controller is called once a tick, in order, whatever steps are rejected") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1);
    plant.stiffness = {400.0};
    Recorder recorder;
    recorder.gain = 300.0;
    Inputs acting(1);
    acting.joints[0].force = {{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 3.0, 300.0, 0.0}};
    acting.sampler = &recorder, acting.rate_Hz = 10.0;
    Run run(plant, acting, grid(2.0, 4.0, 21), 1e-8, implicit);
    CHECK(run({0.3}, {0.0}, 0.5) == Status::done);
    CHECK(run.loop.run_state[0].rejected > 0);
    CHECK(recorder.t.size() == 20);
    for (std::size_t k = 0; k < recorder.t.size(); ++k) {
      CHECK(recorder.t[k] == 2.0 + static_cast<double>(k) / 10.0);
      CHECK_NEAR(recorder.place[k], run.at(static_cast<int>(k), 0),
                 1e-6);  // outputs lie on the ticks here
      CHECK_NEAR(run.drive(static_cast<int>(k), 0),
                 -300.0 * recorder.place[k] - 30.0 * run.at(static_cast<int>(k), 1) +
                     3.0 * std::sin(300.0 * recorder.t[k]),
                 1e-9);
    }
  }
}

TEST("a controller of short ticks by steps of order 3 and 5: three and six passes a tick") {
  Masses<double> plant(1, 1);
  plant.stiffness = {0.0, 400.0};
  Recorder recorder;
  recorder.gain = 30.0;
  Inputs acting(1);
  acting.sampler = &recorder, acting.rate_Hz = 1000.0;
  Inputs *list = &acting;
  Loop<double> loop(plant, &list, grid(0.0, 1.0, 101), 1e-5);
  for (const EmbeddedPair *pair : {&PAIR_3, &PAIR_5}) {
    recorder.t.clear(), recorder.place.clear();
    EmbeddedPairSteps<double> method(loop.integration, *pair);
    const double q0[2] = {1.0, 0.1}, v0[2] = {0.0, 0.0};
    loop.integration.passes = 0;
    loop.start(q0, v0, 1e-3);
    while (loop.advance(method, 100)) {
    }
    CHECK(loop.run_state[0].status == Status::done && recorder.t.size() == 1000);
    CHECK(loop.integration.passes < 1050 * pair->stages);  // a few more where the motion begins
    const double *last = loop.record[0].state.data() + 100 * loop.record[0].size;
    CHECK_NEAR(last[1], 0.1 * std::cos(20.0), 1e-5);
    double q = 1.0, v = 0.0;
    for (int k = 0; k < 1000; ++k) {
      const double a = -30.0 * q - 3.0 * v;
      q += 1e-3 * v + 0.5e-6 * a, v += 1e-3 * a;
    }
    CHECK_NEAR(last[0], q, 1e-10);
  }
}

TEST("what is held between ticks is held: exact motion under steps of force") {
  Masses<double> plant(1);
  Recorder recorder;
  recorder.gain = 3.0;
  Inputs acting(1);
  acting.sampler = &recorder, acting.rate_Hz = 5.0;
  Run run(plant, acting, grid(0.0, 2.0, 3), 1e-6, true);
  CHECK(run({1.0}, {0.0}) == Status::done);
  double q = 1.0, v = 0.0;
  for (int k = 0; k < 10; ++k) {
    const double a = -3.0 * q - 0.3 * v, h = 0.2;
    q += h * v + 0.5 * h * h * a, v += h * a;
  }
  CHECK_NEAR(run.at(2, 0), q, 1e-12);
}

TEST("a force that jumps between outputs") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1);
    Inputs acting(1);
    acting.joints[0].force = {segment(-1.0, 0.0), segment(0.317, 2.0), segment(0.7391, -1.0)};
    Run run(plant, acting, {0.0, 0.5, 1.0}, 1e-6, implicit);
    CHECK(run({0.0}, {0.0}, 0.1) == Status::done);
    CHECK_NEAR(run.at(1, 0), (0.5 - 0.317) * (0.5 - 0.317), 1e-12);
    const double v = 2.0 * (0.7391 - 0.317), rest = 1.0 - 0.7391;
    CHECK_NEAR(run.at(2, 0), 0.25 * v * v + v * rest - 0.5 * rest * rest, 1e-12);
    CHECK_NEAR(run.drive(1, 0), 2.0, 0.0);
    CHECK_NEAR(run.account(2, WORK), 0.5 * run.at(2, 1) * run.at(2, 1), 1e-12);
  }
}

TEST("the time at which a joint meets its limit, to 1e-12 of the run") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(2);
    plant.stiffness = {1.0, 0.0};
    Inputs acting(2);
    acting.low[0] = -0.5;
    Run run(plant, acting, grid(0.0, 10.0, 5), implicit ? 1e-10 : 1e-12, implicit);
    CHECK(run({1.0, 0.0}, {0.0, 0.0}) == Status::limit);
    const int row = run.record().rows - 1;
    CHECK(run.loop.run_state[0].joint == 0);
    CHECK_NEAR(run.record().t[static_cast<std::size_t>(row)], std::acos(-0.5),
               implicit ? 1e-8 : 1e-11);
    CHECK_NEAR(run.at(row, 0), -0.5, 1e-12);
    CHECK(run.at(row, 0) >= -0.5);
    CHECK(row == 1);
  }
}

TEST("a limit met and left again within a step is seen") {
  Masses<double> plant(1);
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, -2.0)};
  acting.high[0] = 0.2;  // q = t - t^2 has its top, 0.25, at 0.5
  Run run(plant, acting, {0.0, 1.0}, 1e-3, true);
  CHECK(run({0.0}, {1.0}, 1.0) == Status::limit);
  CHECK_NEAR(run.loop.run_state[0].t, 0.5 - std::sqrt(0.05), 1e-12);
}

TEST("a function of the caller's is never asked for a time before the step's start") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1);
    plant.stiffness = {25.0};
    Inputs acting(1);
    double begun = -1.0;
    long early = 0, asked = 0;
    acting.function = [&](double t, const double *q, const double *v, double *force) {
      ++asked;
      if (t < begun) ++early;
      force[0] += -10.0 * q[0] - v[0];
    };
    Run run(plant, acting, grid(0.0, 5.0, 101), 1e-7, implicit);
    std::vector<double> q{1.0}, v{0.0};
    run.loop.start(q.data(), v.data(), 0.3);
    while (run.loop.advance(*run.method, 1)) begun = run.loop.run_state[0].t;
    CHECK(run.loop.run_state[0].status == Status::done);
    CHECK(early == 0);
    CHECK(asked > 100);
    const double w = std::sqrt(35.0 - 0.25), t = 5.0;
    CHECK_NEAR(run.at(100, 0), std::exp(-0.5 * t) * (std::cos(w * t) + 0.5 / w * std::sin(w * t)),
               1e-5);
  }
}

TEST("a steep function of the caller's costs implicit steps little") {
  Masses<double> plant(1, 1);
  plant.stiffness = {0.0, 4.0};
  Inputs acting(1);
  long asked = 0;
  acting.function = [&](double, const double *q, const double *v, double *force) {
    ++asked, force[0] += -1e6 * (q[0] - 1.0) - 2e3 * v[0];
  };
  Run run(plant, acting, grid(0.0, 5.0, 11), 1e-5, true);
  CHECK(run({0.0, 1.0}, {0.0, 0.0}) == Status::done);
  CHECK_NEAR(run.at(10, 0), 1.0, 1e-9);
  CHECK_NEAR(run.at(10, 1), std::cos(10.0), 1e-3);
  CHECK(asked < 4000);
}

TEST("a prescribed joint is on its motion, and its drive is what that takes") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1, 1);
    plant.stiffness = {4.0, 9.0}, plant.viscous = {0.5};
    Inputs acting(1);
    acting.joints[0].motion = {{0.0, {0.1, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.3, 2.0, 0.0}};
    acting.joints[0].prescribed = true;
    Run run(plant, acting, grid(0.0, 2.0, 11), 1e-7, implicit);
    CHECK(run({9.0, 0.2}, {9.0, 0.0}) == Status::done);
    for (int k = 0; k < 11; ++k) {
      const double t = run.record().t[static_cast<std::size_t>(k)],
                   q = 0.1 + 0.3 * std::sin(2.0 * t), v = 0.6 * std::cos(2.0 * t);
      CHECK_NEAR(run.at(k, 0), q, 1e-15);
      CHECK_NEAR(run.at(k, 2), v, 1e-15);
      CHECK_NEAR(run.at(k, 1), 0.2 * std::cos(3.0 * t), 1e-5);
      CHECK_NEAR(run.drive(k, 0), -1.2 * std::sin(2.0 * t) + 4.0 * q + 0.5 * v, 1e-12);
    }
    const double rise = 2.0 * std::pow(run.at(10, 0), 2) + 0.5 * std::pow(run.at(10, 2), 2) -
                        2.0 * 0.01 - 0.5 * 0.36;
    CHECK_NEAR(run.account(10, WORK) - run.account(10, LOSS), rise, 1e-6);
  }
}

TEST("Coulomb friction stops a mass, and holds it") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(1);
    plant.coulomb = {2.0};
    Inputs acting(1);
    Run run(plant, acting, grid(0.0, 2.0, 21), 1e-5, implicit);
    CHECK(run({0.0}, {1.0}) == Status::done);
    CHECK_NEAR(run.at(20, 0), 0.25, 1e-3);
    CHECK_NEAR(run.at(20, 1), 0.0, 1e-6);
    CHECK_NEAR(run.account(20, LOSS), 0.5, 2e-5);
  }
  Masses<double> plant(1);
  plant.coulomb = {2.0};
  Inputs acting(1);
  Run run(plant, acting, grid(0.0, 20.0, 2), 1e-5, true);
  CHECK(run({0.0}, {1.0}) == Status::done);
  CHECK(run.loop.integration.passes < 2000);  // the mass sticks: long steps
}

TEST("what is not a number ends the run at once, with its place") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(2);
    Inputs acting(2);
    acting.function = [](double t, const double *, const double *, double *force) {
      force[1] = t > 0.5 ? std::nan("") : 1.0;
    };
    Run run(plant, acting, grid(0.0, 1.0, 11), 1e-6, implicit);
    CHECK(run({0.0, 0.0}, {0.0, 0.0}, 0.1) == Status::diverged);
    CHECK(run.loop.run_state[0].joint == 1);
    CHECK_NEAR(run.loop.run_state[0].t, 0.5, 1e-9);
    CHECK(run.record().rows >= 5);
    CHECK_NEAR(run.at(4, 1), 0.5 * 0.16, 1e-9);
  }
}

TEST("a force too steep for any step ends as stuck, and says where") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(2);
    Inputs acting(2);
    acting.function = [](double, const double *q, const double *, double *force) {
      force[1] = 1.0 / ((0.3 - q[1]) * (0.3 - q[1]) * (0.3 - q[1]));
    };
    Run run(plant, acting, grid(0.0, 10.0, 10001), 1e-6, implicit);
    const Status status = run({0.0, 0.0}, {0.0, 0.5}, 0.01);
    CHECK(status == Status::stuck || status == Status::diverged);
    CHECK(run.loop.run_state[0].joint == 1);
    CHECK(run.record().rows > 1);
  }
}

TEST("a budget of steps, an interruption") {
  Masses<double> plant(1);
  plant.stiffness = {1e4};
  Inputs acting(1);
  Run run(plant, acting, grid(0.0, 1.0, 101), 1e-6, false);
  run.loop.most_steps = 10;
  CHECK(run({1.0}, {0.0}) == Status::exhausted);
  CHECK(run.loop.run_state[0].steps + run.loop.run_state[0].rejected == 10);
  Run other(plant, acting, grid(0.0, 1.0, 101), 1e-6, false);
  std::atomic<bool> stop{false};
  std::atomic<double> reached{0.0};
  other.loop.interrupt = &stop, other.loop.progress = &reached;
  std::vector<double> q{1.0}, v{0.0};
  other.loop.start(q.data(), v.data(), 1e-3);
  CHECK(other.loop.advance(*other.method, 5));
  CHECK(reached.load() > 0.0);
  stop = true;
  CHECK(!other.loop.advance(*other.method, 5));
  CHECK(other.loop.run_state[0].status == Status::interrupted);
}

TEST("a rehearsal leaves no trace") {
  Masses<double> plant(1, 1);
  plant.stiffness = {4.0, 900.0};
  auto run = [&](bool rehearse) {
    Recorder recorder;
    recorder.gain = 5.0;
    Inputs acting(1);
    acting.sampler = &recorder, acting.rate_Hz = 3.0;
    Inputs *list = &acting;
    Loop<double> loop(plant, &list, grid(0.0, 2.0, 21), 1e-6);
    Explicit<double> explicit_steps(loop.integration);
    Implicit<double> implicit_steps(loop.integration);
    const double q0[2] = {1.0, 0.1}, v0[2] = {0.0, 0.0};
    loop.start(q0, v0, 1e-3);
    while (loop.advance(explicit_steps, 20)) {
      if (!rehearse) {
        loop.restore(loop.snapshot());
        continue;
      }
      const auto here = loop.snapshot();
      loop.rehearsal = true;
      loop.advance(implicit_steps, 30);
      loop.rehearsal = false;
      loop.restore(here);
    }
    CHECK(recorder.t.size() == 6);
    return loop.record[0].state;
  };
  CHECK(run(true) == run(false));
}

TEST("a budget that a rejected step uses up, or the last step of a run") {
  Masses<double> plant(1);
  plant.stiffness = {1e4};
  Inputs acting(1);
  Run rejected(plant, acting, grid(0.0, 1.0, 3), 1e-6, true);
  rejected.loop.most_steps = 1;
  CHECK(rejected({1.0}, {0.0}, 0.9) == Status::exhausted);
  CHECK(rejected.loop.run_state[0].rejected == 1 && rejected.loop.run_state[0].t == 0.0);
  Run whole(plant, acting, grid(0.0, 1.0, 3), 1e-6, true);
  CHECK(whole({1.0}, {0.0}) == Status::done);
  const RunState &took = whole.loop.run_state[0];
  Run exact(plant, acting, grid(0.0, 1.0, 3), 1e-6, true);
  exact.loop.most_steps = took.steps + took.rejected;
  CHECK(exact({1.0}, {0.0}) == Status::done);
  CHECK(exact.loop.run_state[0].t == 1.0 && exact.record().rows == 3);
  CHECK(exact.record().state == whole.record().state);
  Run less(plant, acting, grid(0.0, 1.0, 3), 1e-6, true);
  less.loop.most_steps = took.steps + took.rejected - 1;
  CHECK(less({1.0}, {0.0}) == Status::exhausted && less.loop.run_state[0].t < 1.0);
}

TEST("a joint that leaves from its limit stays there; a run that goes on has the row of a limit") {
  Masses<double> plant(1);
  Inputs acting(1);
  acting.high[0] = 0.2;
  Run there(plant, acting, grid(0.0, 1.0, 3), 1e-6, false);
  CHECK(there({0.2}, {1.0}) == Status::limit);
  CHECK(there.loop.run_state[0].t == 0.0 && there.record().rows == 1 && there.at(0, 0) == 0.2);
  Run later(plant, acting, {0.0, 0.1}, 1e-6, false);
  CHECK(later({0.0}, {1.0}) == Status::done);
  later.loop.go_on(1.0, 1.0, false);
  while (later.loop.advance(*later.method, 100)) {
  }
  CHECK(later.loop.run_state[0].status == Status::limit && later.record().rows == 1);
  CHECK_NEAR(later.record().t[0], 0.2, 1e-12);
  CHECK_NEAR(later.at(0, 0), 0.2, 1e-12);
}

TEST("a joint on its motion: Coulomb friction is the drive's, a locked one does not follow") {
  for (bool implicit : {false, true}) {
    Masses<double> plant(2);
    plant.coulomb = {0.4, 0.0}, plant.locked[1] = true;
    Inputs acting(2);
    for (JointDrive &drive : acting.joints)
      drive.motion = {segment(0.0, 0.0, 0.5)}, drive.prescribed = true;
    Run run(plant, acting, grid(0.0, 1.0, 5), 1e-7, implicit);
    CHECK(run({0.0, 0.3}, {0.5, 0.0}) == Status::done);
    for (int k = 0; k < 5; ++k) {
      CHECK_NEAR(run.at(k, 0), 0.125 * k, 1e-15);
      CHECK_NEAR(run.drive(k, 0), 0.4, 1e-12);
      CHECK(run.at(k, 1) == 0.3 && run.at(k, 3) == 0.0);
    }
    CHECK_NEAR(run.account(4, LOSS), 0.2, 1e-9);
  }
}
