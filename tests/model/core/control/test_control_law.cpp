// The sampled controller: the law's terms one by one, its limits and delays, and the board's
// integers beside the model's doubles.
#include <limits>

#include "check.hpp"
#include "control/control_law.hpp"
#include "integration/runge_kutta/implicit.hpp"
#include "integration/time_loop.hpp"
#include "plants.hpp"

using namespace flexura;

namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();
Segment segment(double t0, double c0, double c1 = 0.0) {
  return {t0, {c0, c1, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}

// A controller of one joint at 100 Hz without limits.
ControlLaw one_joint() {
  ControlLaw law;
  law.joints.resize(1), law.rate_Hz = 100.0, law.first = {0};
  law.joints[0].output = JointLaw::Output::force;
  law.joints[0].gains.limit = law.joints[0].gains.slew = INFINITE;
  return law;
}
double force_at(ControlLaw &law, long k, double q, SampledOutput &held) {
  law.tick(k, 0.01 * static_cast<double>(k), &q, nullptr, held);
  return held.force[0];
}
SampledOutput outputs(int joints) { return Inputs(joints).held; }

}  // namespace

TEST("the terms of the law") {
  ControlLaw law = one_joint();
  JointLaw &j = law.joints[0];
  j.gains.kp = 3.0, j.gains.ki = 20.0, j.gains.kd = 0.5, j.gains.kv = 0.25, j.gains.kc = 0.125;
  j.reference = {segment(0.0, 1.0, 2.0)}, j.feedforward = {segment(0.0, 10.0)};
  SampledOutput held = outputs(1);
  CHECK_NEAR(force_at(law, 0, 0.5, held), 3.0 * 0.5 + 20.0 * 0.5 * 0.01 + 10.0, 1e-13);
  const double e = 1.02 - 0.6, rate = 10.0, asked = 2.0;
  const double expected =
      3.0 * e + 0.2 * (0.5 + e) + 0.5 * (asked - rate) + 0.25 * asked + 0.125 + 10.0;
  CHECK_NEAR(force_at(law, 1, 0.6, held), expected, 1e-12);
}

TEST("limit, slew, and a sum that stands still while they hold the output back") {
  ControlLaw law = one_joint();
  JointLaw &j = law.joints[0];
  j.gains.ki = 100.0, j.gains.limit = 2.0, j.gains.slew = 50.0, j.reference = {segment(0.0, 1.0)};
  SampledOutput held = outputs(1);
  double last = 0.0;
  for (long k = 0; k < 50; ++k) {
    const double u = force_at(law, k, 0.0, held);
    CHECK(u <= 2.0 && std::fabs(u - last) <= 0.5 + 1e-15);
    last = u;
  }
  CHECK_NEAR(last, 2.0, 1e-12);
  force_at(law, 50, 2.0, held);
  CHECK(held.force[0] < 2.0);  // at once: nothing has wound up
}

TEST("delays, resolutions, filters") {
  ControlLaw law = one_joint();
  JointLaw &j = law.joints[0];
  j.gains.kp = 1.0, j.delay = 2, j.count = 0.1, j.duty = 0.25;
  SampledOutput held = outputs(1);
  const double q[] = {-0.52, -1.0, -1.96, 0.0};
  double got[4];
  for (long k = 0; k < 4; ++k) got[k] = force_at(law, k, q[k], held);
  CHECK(got[0] == 0.0 && got[1] == 0.0 && got[2] == 0.5 && got[3] == 1.0);

  ControlLaw slow = one_joint();
  slow.joints[0].gains.kp = 1.0, slow.joints[0].setpoint = 0.25,
  slow.joints[0].reference = {segment(-1.0, 0.0), segment(0.0, 1.0)};
  SampledOutput other = outputs(1);
  for (long k = 0; k < 5; ++k)
    CHECK_NEAR(force_at(slow, k, 0.0, other), 1.0 - std::pow(0.75, static_cast<double>(k + 1)),
               1e-13);
}

TEST("the strip: two ticks make a reading, one joint takes it at once and the other in the next") {
  ControlLaw law;
  law.joints.resize(2), law.rate_Hz = 100.0, law.first = {0, 1};
  for (JointLaw &j : law.joints) {
    j.output = JointLaw::Output::force, j.gains.limit = j.gains.slew = INFINITE;
    j.gains.kf = 1.0, j.gains.kg = 0.1, j.ks = 2.0;
  }
  double w = 0.0;
  law.strip = [&](const double *) { return Bend{w, 0.5 * w}; };
  SampledOutput held = outputs(2);
  const double q[2] = {0.0, 0.0};
  std::vector<double> first, second;
  for (long k = 0; k < 5; ++k) {
    w = 0.01 * static_cast<double>(k);
    law.tick(k, 0.01 * static_cast<double>(k), q, nullptr, held);
    first.push_back(held.force[0]), second.push_back(held.force[1]);
  }
  const double at2 = 0.015 + 0.1 * 0.015 * 50.0 + 2.0 * 0.0075,
               at4 = 0.035 + 0.1 * 0.02 * 50.0 + 2.0 * 0.0175;
  CHECK_NEAR(first[2], at2, 1e-14), CHECK_NEAR(first[3], at2, 1e-14),
      CHECK_NEAR(first[4], at4, 1e-14);
  CHECK_NEAR(second[1], 0.0, 1e-14), CHECK_NEAR(second[2], 0.0, 1e-14),
      CHECK_NEAR(second[3], at2, 1e-14);
}

TEST("a stepper's joint follows its pulses without a jump, by any step") {
  Masses<double> plant(1);
  ControlLaw law;
  law.joints.resize(1), law.rate_Hz = 200.0, law.first = {0};
  JointLaw &j = law.joints[0];
  j.output = JointLaw::Output::stepper, j.rigid = true;
  j.gains.kp = 8.0, j.gains.limit = 2.0, j.gains.slew = 20.0, j.reference = {segment(0.0, 0.4)};
  Inputs acting(1);
  acting.sampler = &law, acting.rate_Hz = 200.0;
  acting.joints[0].sampled = acting.joints[0].prescribed = true;
  Inputs *list = &acting;
  std::vector<double> t;
  for (int k = 0; k <= 400; ++k) t.push_back(0.005 * k);
  Loop<double> loop(plant, &list, t, 1e-6);
  Implicit<double> method(loop.integration);
  const double zero[1] = {0.0};
  loop.start(zero, zero, 1e-3);
  while (loop.advance(method, 100)) {
  }
  CHECK(loop.run_state[0].status == Status::done);
  const Record &r = loop.record[0];
  for (int k = 1; k < r.rows; ++k) {
    const double v = r.state[std::size_t(k * r.size + 1)],
                 before = r.state[std::size_t((k - 1) * r.size + 1)];
    CHECK(std::fabs(v - before) <= 20.0 * 0.005 + 1e-9);
    const double way = r.state[std::size_t(k * r.size)] - r.state[std::size_t((k - 1) * r.size)];
    CHECK_NEAR(way, 0.5 * (v + before) * 0.005, 1e-9);
  }
  CHECK_NEAR(r.state[std::size_t(400 * r.size)], 0.4, 1e-3);
  CHECK(law.log.size() == 400);
}

TEST("a linear law: a dead-beat estimate and state feedback by hand") {
  ControlLaw law = one_joint();
  law.linear.states = 1, law.linear.measurements = 1;
  law.linear.F = {0.9}, law.linear.G = {0.1}, law.linear.L = {1.0}, law.linear.C = {1.0},
  law.linear.K = {2.0};
  law.linear.Kr = {3.0}, law.linear.Kv = {0.0}, law.linear.offset = {0.5}, law.linear.hold = {7.0};
  law.joints[0].reference = {segment(0.0, 1.5)};
  SampledOutput held = outputs(1);
  CHECK_NEAR(force_at(law, 0, 0.8, held), 7.0 - 2.0 * 0.3 + 3.0 * 1.0, 1e-13);
  CHECK_NEAR(force_at(law, 1, 0.9, held), 7.0 - 2.0 * 0.4 + 3.0 * 1.0, 1e-13);
}

TEST("the board's integers compute what the doubles compute, to their resolution") {
  GainsOf<BoardNumbers> board;
  board.kp = 3 * 65536, board.ki = 1 << 28, board.kd = 256 * 2, board.kv = 256, board.kc = 40,
  board.limit = 12000, board.slew = 900;
  GainsOf<ModelNumbers> model;  // in counts and units of u
  model.kp = 3.0, model.ki = 1.0 / 16, model.kd = 2.0 * 256 / 65536 * 256,
  model.kv = 256.0 / 65536 * 256, model.kc = 40.0;
  model.kd /= 256.0, model.kv /= 256.0;  // rates below in counts / 256
  model.limit = 12000.0, model.slew = 900.0;
  Pid integers;
  PidOf<ModelNumbers> doubles;
  integers.start(0), doubles.start(0.0);
  check::Random random;
  for (int k = 0; k < 2000; ++k) {
    const int32_t error =
        static_cast<int32_t>(std::lround(1500.0 * std::sin(0.01 * k) + random(-20.0, 20.0)));
    const int16_t rate = static_cast<int16_t>(random(-2000.0, 2000.0)),
                  asked = static_cast<int16_t>(500.0 * std::cos(0.02 * k));
    const double a = integers.update(board, PidSignals{error * 256, rate, asked, 0});
    const double b = doubles.update(
        model, SignalsOf<ModelNumbers>{double(error), double(rate), double(asked), 0.0});
    CHECK_NEAR(a, b, 8.0);
  }
}

TEST("the board's observer finds what that of doubles finds, to its resolution") {
  ObserverGainsOf<BoardNumbers> board;
  board.moving = 900 * 256, board.inertia = 1200 * 256, board.filter = 4096;
  ObserverGainsOf<ModelNumbers> model;  // rates in counts / 256
  model.moving = 900.0 / 256, model.inertia = 1200.0 / 256, model.filter = 1.0 / 16;
  DisturbanceObserverOf<BoardNumbers> integers;
  DisturbanceObserverOf<ModelNumbers> doubles;
  integers.start(), doubles.start();
  check::Random random;
  for (int k = 0; k < 2000; ++k) {
    const int16_t u = static_cast<int16_t>(random(-16000.0, 16000.0)),
                  rate = static_cast<int16_t>(random(-2000.0, 2000.0));
    CHECK_NEAR(integers.update(board, u, rate) / 65536.0, doubles.update(model, u, rate), 1e-3);
  }
  board.filter = 0;
  CHECK(integers.update(board, 100, 100) == 0);
}

TEST("with an observer a constant load leaves no error, and the next tick's law takes it") {
  ControlLaw law = one_joint();
  JointLaw &j = law.joints[0];
  j.gains.kp = 4.0, j.inertia = 0.5, j.damping = 0.8, j.observer = 0.2;
  SampledOutput held = outputs(1);
  double q = 0.0, v = 0.0;
  for (long k = 0; k < 4000; ++k) {
    const double u = force_at(law, k, q, held);
    for (int part = 0; part < 10; ++part) q += 1e-3 * v, v += 1e-3 * (u - 0.8 * v - 0.3) / 0.5;
  }
  CHECK_NEAR(q, 0.0, 1e-6);
  CHECK_NEAR(held.force[0], 0.3, 1e-6);
}
