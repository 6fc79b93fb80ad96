// Controllers at work on robots: beside the board's law and a recursion written out; tips; rows of
// gains; figures.
#include "check.hpp"
#include "control/controller.hpp"
#include "control/model_plant.hpp"
#include "integration/time_loop.hpp"
#include "link/assembly.hpp"
#include "simulation/gain_sweep.hpp"
#include "simulation/method_by_name.hpp"
#include "simulation/method_selection.hpp"

using namespace flexura;

namespace {

constexpr double T = 1e-3, INFINITE = std::numeric_limits<double>::infinity(),
                 PI = 3.14159265358979323846;

Signal constant(double y) { return {Segment{0.0, {y, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0}}; }
Signal step_to(double y) {
  return {Segment{-1e300, {0.0}, 0.0, 0.0, 0.0}, Segment{0.0, {y}, 0.0, 0.0, 0.0}};
}

Link rigid(JointKind kind, double length, double mass) {
  Link link;
  link.length = length, link.mass = mass, link.centre = 0.5 * length,
  link.inertia = mass * length * length / 12.0;
  link.joint.kind = kind, link.joint.low = -INFINITE, link.joint.high = INFINITE;
  return link;
}
Link strip(JointKind kind, double length, int elements, int modes = -1) {
  Link link;
  link.length = length, link.elements = elements, link.modes = modes, link.beta = 2e-4;
  Interval all;
  all.to = length, all.mass[0] = 0.157, all.stiffness[0] = 0.3333;
  link.material.push_back(all);
  link.joint.kind = kind, link.joint.rotor = 1e-3, link.joint.low = -INFINITE,
  link.joint.high = INFINITE;
  if (kind == JointKind::sleeve) link.joint.start = 0.6 * length, link.joint.rotor = 0.1;
  return link;
}
using Shared = std::shared_ptr<const Model<double>>;
Shared made(std::vector<Link> links, double payload = 0.02) {
  Robot robot;
  robot.links = std::move(links), robot.payload_mass = payload;
  return std::make_shared<const Model<double>>(assemble(robot));
}
std::vector<double> rest(const Model<double> &model) {
  std::vector<double> q(std::size_t(model.n), 0.0);
  for (int i = 0; i < model.links(); ++i)
    q[std::size_t(model.first[std::size_t(i)])] = model.start[std::size_t(i)];
  return q;
}
// A joint's law: output, reference, row of gains, coupling.
struct Driven {
  JointLaw::Output output = JointLaw::Output::force;
  Signal reference;
  double gain[GAINS] = {};
  Coupling coupling;
};
Driven effort(double kp, double kd, Signal reference) {
  Driven joint;
  joint.reference = std::move(reference);
  joint.gain[KP] = kp, joint.gain[KD] = kd;
  joint.gain[LIMIT] = joint.gain[SLEW] = INFINITE;
  joint.gain[FORCE] = joint.gain[SETPOINT] = joint.gain[DERIVATIVE] = joint.gain[DEFLECTION] = 1.0;
  return joint;
}
Controller controlled(const Shared &robot, const std::vector<Driven> &joints,
                      double quantum = 0.0) {
  std::vector<JointLaw> laws;
  std::vector<Coupling> couplings;
  std::vector<double> gains;
  for (const Driven &joint : joints) {
    JointLaw law;
    law.output = joint.output, law.reference = joint.reference;
    laws.push_back(law), couplings.push_back(joint.coupling);
    gains.insert(gains.end(), joint.gain, joint.gain + GAINS);
  }
  Controller controller(robot, laws, couplings, 1000.0, quantum, LinearLaw());
  controller.set_gains(gains.data());
  return controller;
}
std::vector<double> ticks(int count, int every = 1) {
  std::vector<double> t;
  for (int k = 0; k <= count; k += every) t.push_back(k / 1000.0);
  return t;
}

// A run of a robot from rest under a controller.
struct RunOf {
  Workspace<double> work;
  ModelPlant<double> plant;
  Inputs acting;
  Inputs *list = &acting;
  std::unique_ptr<Loop<double>> loop;

  RunOf(const Model<double> &model, Controller &controller, const std::vector<double> &t,
        double rtol, const char *name)
      : work(model), plant(model, work), acting(model.links()) {
    const std::vector<double> q = rest(model), v(q.size(), 0.0);
    controller.start(acting, q.data());
    loop = std::make_unique<Loop<double>>(plant, &list, t, rtol);
    const std::unique_ptr<Method<double>> method = make_method(name, loop->integration);
    MethodSelection selection(*loop, rtol);  // of "auto", which is no method
    loop->start(q.data(), v.data(), (t.back() - t.front()) * 1e-4);
    while (method ? loop->advance(*method, 1000) : selection.advance(1000)) {
    }
    CHECK(loop->run_state[0].status == Status::done);
  }
  double at(int row, int k) const {
    return loop->record[0].state[std::size_t(row * loop->record[0].size + k)];
  }
};

Plan plan_of(Shared robot, const std::vector<Driven> &joints, int count, double rtol = 1e-6) {
  Inputs acting(robot->links());
  Plan plan{robot, acting, controlled(robot, joints), ticks(count, 5), rest(*robot), {},
            rtol,  "auto"};
  for (int i = 0; i < robot->links(); ++i)
    for (double t : plan.t)
      plan.reference.push_back(evaluate(joints[std::size_t(i)].reference, t).y);
  return plan;
}

}  // namespace

TEST(
    "where the board's integers round nothing, both laws give the same outputs to the last digit") {
  check::Random random{7};
  const auto whole = [&](int from, int to) { return int(std::floor(random(from, to + 1))); };
  for (int trial = 0; trial < 200; ++trial) {
    PidGains board;
    board.kp = whole(-3, 6) * 65536, board.ki = whole(-4, 40) * (1 << 20),
    board.kd = whole(-2, 4) * 256, board.kv = whole(-2, 3) * 256;
    board.kf = whole(-3, 3) * 65536, board.kg = whole(-3, 3) * 256;
    board.kc = int16_t(whole(-20, 20)), board.limit = int16_t(whole(100, 12000)),
    board.slew = int16_t(whole(5, 3000));
    GainsOf<ModelNumbers> real;
    real.kp = board.kp / 65536.0, real.ki = board.ki / 4294967296.0, real.kd = board.kd / 256.0,
    real.kv = board.kv / 256.0;
    real.kc = board.kc, real.limit = board.limit, real.slew = board.slew;
    Pid pid;
    PidOf<ModelNumbers> law;
    int error = 0;
    for (int k = 0; k < 400; ++k) {
      if (whole(0, 9) == 0) error = whole(-7, 7);
      const int e = 4096 * error, rate = whole(-9, 9), setpoint_rate = whole(-9, 9),
                w = whole(-50, 50), w_rate = whole(-20, 20);
      const int32_t tip = added_terms(board, int16_t(w), int16_t(256 * w_rate), 0);
      const double tip_real = board.kf / 65536.0 * w + board.kg / 256.0 * w_rate;
      CHECK(tip / 65536.0 == tip_real);
      const int16_t u = pid.update(
          board, PidSignals{e * 256, int16_t(256 * rate), int16_t(256 * setpoint_rate), tip});
      CHECK(u == law.update(real, SignalsOf<ModelNumbers>{double(e), double(rate),
                                                          double(setpoint_rate), tip_real}));
    }
    CHECK(pid.track(board, 77) == law.track(real, 77.0));
  }
}

TEST("a cart follows the recursion written out") {
  check::Random random{3};
  for (int trial = 0; trial < 12; ++trial) {
    const double mass = 2.0, reference = 0.3;
    Driven joint = effort(random(50.0, 400.0), random(0.0, 25.0), step_to(reference));
    double *g = joint.gain;
    g[KI] = random(0.0, 900.0), g[KV] = random(0.0, 3.0), g[KC] = 0.5,
    g[SETPOINT] = random(0.01, 1.0), g[DERIVATIVE] = random(0.1, 1.0);
    g[DELAY] = trial % 3;
    if (trial % 2) g[LIMIT] = 20.0, g[SLEW] = 3000.0;
    const Shared robot = made({rigid(JointKind::slider, 0.0, mass)}, 0.0);
    Controller controller = controlled(robot, {joint});
    const RunOf run(*robot, controller, ticks(300), 1e-12, "explicit");
    double x = 0.0, v = 0.0, r = 0.0, last = 0.0, speed = 0.0, sum = 0.0, u = 0.0;
    std::vector<double> outputs(std::size_t(g[DELAY]), 0.0);
    for (int k = 0; k <= 300; ++k) {
      CHECK_NEAR(run.at(k, 0), x,
                 trial % 2 ? 1e-7 : 1e-11);  // round-off may fall on the other side of a limit
      const double change = g[SETPOINT] * (reference - r);
      r += change;
      speed += g[DERIVATIVE] * ((x - last) / T - speed), last = x;
      const double e = r - x, grown = sum + g[KI] * e * T,
                   total = std::fabs(grown) <= g[LIMIT] ? grown : sum;
      const double wish = g[KP] * e + total + g[KD] * (change / T - speed) + g[KV] * change / T +
                          (change > 0.0   ? g[KC]
                           : change < 0.0 ? -g[KC]
                                          : 0.0);
      u = std::fmin(std::fmax(std::fmin(std::fmax(wish, -g[LIMIT]), g[LIMIT]), u - g[SLEW] * T),
                    u + g[SLEW] * T);
      if (!(wish > u && e >= 0.0) && !(wish < u && e < 0.0)) sum = total;
      outputs.push_back(u);
      const double force = outputs[std::size_t(k)] / mass;
      x += T * (v + 0.5 * T * force), v += T * force;
    }
    CHECK(controller.ticks() == 300);
    CHECK_NEAR(controller.logged(299, 0).output, outputs[299], trial % 2 ? 1e-3 : 1e-8);
  }
}

TEST(
    "a stepper's pulses are the integral of its rate, and a joint without a spring is held to "
    "them") {
  const Shared robot =
      made({rigid(JointKind::slider, 0.1, 0.6), strip(JointKind::revolute, 0.3, 4, 2)});
  Driven held = effort(900.0, 50.0, constant(0.0)), step = effort(20.0, 0.0, step_to(0.4));
  step.output = JointLaw::Output::stepper;
  double *g = step.gain;
  g[LIMIT] = 2.0, g[SLEW] = 60.0, g[DELAY] = 1.0, g[RIGID] = 1.0;
  Controller controller = controlled(robot, {held, step});
  const RunOf run(*robot, controller, ticks(600), 1e-6, "explicit-5");
  const int row = robot->first[1];
  double place = 0.0, before = 0.0;
  for (int k = 0; k < 600; ++k) {
    const double given = controller.logged(k, 1).output;
    CHECK_NEAR(run.at(k, row), place, 1e-13);
    place += 0.5 * T * (before + given), before = given;
  }
  CHECK(std::fabs(place - 0.4) < 0.01);
}

TEST("a robot that starts elsewhere is not moved by a stepper that stands still") {
  const Shared robot = made({strip(JointKind::sleeve, 0.4, 4)});
  Driven step = effort(5.0, 0.0, constant(robot->start[0]));
  step.output = JointLaw::Output::stepper, step.gain[RIGID] = 1.0;
  Controller controller = controlled(robot, {step});
  const RunOf run(*robot, controller, ticks(20), 1e-6, "explicit");
  for (int k = 0; k <= 20; ++k) CHECK(run.at(k, 0) == robot->start[0]);
}

TEST("what the law measures of a tip is what a run shows of it") {
  check::Random random{5};
  const std::vector<std::vector<Link>> robots = {
      {strip(JointKind::revolute, 0.3, 6)},
      {rigid(JointKind::slider, 0.1, 0.6), strip(JointKind::revolute, 0.3, 4, 3)},
      {strip(JointKind::sleeve, 0.4, 4)},
      {strip(JointKind::revolute, 0.3, 3), strip(JointKind::slider, 0.2, 2)},
      {strip(JointKind::revolute, 0.3, 3), strip(JointKind::sleeve, 0.3, 4, 2)}};
  for (const auto &links : robots) {
    const Shared robot = made(links);
    Observer observer(*robot, 2);
    Workspace<double> work(*robot);
    std::vector<double> q = rest(*robot), v(q.size(), 0.0), row(std::size_t(observer.columns()));
    for (int trial = 0; trial < 5; ++trial) {
      q = rest(*robot);
      for (double &x : q) x += random(-0.05, 0.05);
      observer.observe(q.data(), v.data(), row.data());
      std::size_t at = 0;
      for (int link = 0; link < robot->links(); ++link) {
        at += 3;
        if (robot->elastic[std::size_t(link)] == 0) continue;
        const Bend tip = bend(*robot, work, q.data(), link);
        CHECK(tip.deflection == row[at] && tip.slope == row[at + 1]);
        CHECK_NEAR(tip.deflection, row[at + 3], 1e-15);  // the last of two stations, by another way
        at += 4;
      }
    }
  }
}

TEST("a strip bent to a circle has a circle's tip") {
  const Shared robot = made({strip(JointKind::revolute, 0.3, 8)});
  std::vector<double> q(std::size_t(robot->n), 0.0);
  Workspace<double> work(*robot);
  for (double angle : {0.01, 1.0, 3.0}) {
    for (int e = 0; e < 8; ++e) q[std::size_t(1 + 2 * e)] = angle / 8.0;
    const Bend tip = bend(*robot, work, q.data(), 0);
    CHECK_NEAR(tip.slope, angle, 1e-14);
    CHECK_NEAR(tip.deflection, 0.3 / angle * (1.0 - std::cos(angle)), 1e-9 * angle);
  }
}

TEST("the strip's terms: the mean of two ticks, every second tick, each joint in its turn") {
  const Shared robot =
      made({rigid(JointKind::revolute, 0.1, 0.5), strip(JointKind::revolute, 0.3, 4, 2)});
  Driven one = effort(0.0, 0.0, constant(0.0)), two = one;
  one.gain[KF] = 3.0, one.gain[KG] = 0.01, two.gain[KS] = 2.0, two.gain[KT] = 0.02;
  one.gain[DEFLECTION] = 0.3;
  Controller controller = controlled(robot, {one, two}, 1e-3);
  Inputs acting(2);
  controller.start(acting, rest(*robot).data());
  check::Random random{11};
  double w = 0.0, s = 0.0, dw = 0.0, ds = 0.0, w1 = 0.0, s1 = 0.0, u[2] = {0.0, 0.0};
  for (long k = 0; k < 40; ++k) {
    const Bend seen{random(-0.01, 0.01), random(-0.1, 0.1)};
    const double still[2] = {0.0, 0.0}, reading = 1e-3 * std::floor(seen.deflection / 1e-3 + 0.5);
    if (k == 0) w = w1 = reading, s = s1 = seen.slope;
    if (k % 2 == 0) {
      dw = 0.3 * (0.5 * (w1 + reading) - w), ds = 0.3 * (0.5 * (s1 + seen.slope) - s);
      w += dw, s += ds;
      u[0] = 3.0 * w + 0.01 * dw / (2.0 * T);
    } else {
      u[1] = 2.0 * s + 0.02 * ds / (2.0 * T);
    }
    w1 = reading, s1 = seen.slope;
    controller.step(k, double(k) * T, still, seen, acting.held);
    for (int i = 0; i < 2; ++i) CHECK_NEAR(acting.held.force[std::size_t(i)], u[i], 1e-14);
  }
}

TEST("every method gives the same motion under a controller, also between its ticks") {
  const Shared robot =
      made({rigid(JointKind::slider, 0.1, 0.6), strip(JointKind::revolute, 0.3, 4, 2)});
  Driven motor = effort(300.0, 0.0, step_to(0.05)), turn = effort(3.0, 0.1, step_to(0.4));
  motor.gain[FORCE] = 13.0, motor.coupling.damping = 120.0,
  motor.gain[SETPOINT] = turn.gain[SETPOINT] = 0.02;
  std::vector<double> t;
  for (int k = 0; k <= 100; ++k) t.push_back(0.004 * k + 0.0001 * (k % 3));  // not on ticks
  Controller controller = controlled(robot, {motor, turn});
  const RunOf exact(*robot, controller, t, 1e-11, "explicit");
  for (const auto &[name, rtol, most] :
       {std::tuple{"explicit-3", 1e-5, 1e-4}, std::tuple{"explicit-5", 1e-7, 1e-6},
        std::tuple{"implicit", 1e-7, 1e-6}}) {
    const RunOf run(*robot, controller, t, rtol, name);
    for (int k = 0; k <= 100; ++k)
      for (int i = 0; i < 2; ++i)
        CHECK_NEAR(run.at(k, robot->first[std::size_t(i)]),
                   exact.at(k, robot->first[std::size_t(i)]), most);
  }
}

TEST("a first-order rise has its formulas") {
  std::vector<double> t, y, r(20001, 1.0);
  for (int k = 0; k <= 20000; ++k)
    t.push_back(k / 4000.0), y.push_back(1.0 - std::exp(-t.back() / 0.2));
  double out[JOINT_FIGURES] = {};
  joint_metrics(Samples{t.data(), 20001}, r.data(), y.data(), out);
  CHECK_NEAR(out[RISE], 0.2 * std::log(9.0), 1e-5);
  CHECK_NEAR(out[SETTLING], 0.2 * std::log(50.0), 1e-5);
  CHECK_NEAR(out[ITAE], 0.04, 1e-6);
  CHECK(out[OVERSHOOT] == 0.0);
}

TEST(
    "a row of gains is its run; rows, order and threads do not matter; a row is given up where it "
    "costs too "
    "much") {
  const Shared robot = made({strip(JointKind::revolute, 0.3, 2)});
  Driven joint = effort(2.0, 0.1, step_to(PI / 4.0));
  joint.gain[LIMIT] = 0.5, joint.gain[SETPOINT] = 0.02, joint.gain[DEFLECTION] = 0.5;
  Plan plan = plan_of(robot, {joint}, 1000);
  GainSweep trials(plan);
  const int rows = 9, width = plan.figures();
  std::vector<double> gains(std::size_t(rows * GAINS)), limits(rows, INFINITE),
      figures(std::size_t(rows * width)), reached(rows);
  check::Random random{2};
  for (int b = 0; b < rows; ++b) {
    double *g = gains.data() + b * GAINS;
    std::copy(joint.gain, joint.gain + GAINS, g);
    g[KP] = random(0.3, 10.0), g[KD] = random(0.05, 1.0), g[KF] = random(-5.0, 5.0);
  }
  std::vector<double> price(std::size_t(width), 0.0), free(price);
  price[ITAE] = 1.0, price[OVERSHOOT] = 1.0, price[EFFORT] = 0.01,
  price[int(JOINT_FIGURES) + VIBRATION] = 300.0, free[OVERSHOOT] = 0.05;
  const Prices prices{price.data(), free.data()};
  trials.run(prices, gains.data(), limits.data(), rows, 1, figures.data(), reached.data());

  std::vector<double> again(figures.size()), far(rows);
  trials.run(prices, gains.data(), limits.data(), rows, 3, again.data(), far.data());
  for (std::size_t k = 0; k < again.size(); ++k) CHECK(check::same_bits(again[k], figures[k]));
  for (int b = rows; b-- > 0;)
    trials.run(prices, gains.data() + b * GAINS, limits.data(), 1, 1, again.data() + b * width,
               far.data() + b);
  for (std::size_t k = 0; k < again.size(); ++k) CHECK(check::same_bits(again[k], figures[k]));

  std::vector<double> costs;
  for (int b = 0; b < rows; ++b) {
    double cost = 0.0;
    for (int k = 0; k < width; ++k)
      if (price[std::size_t(k)] > 0.0)
        cost += price[std::size_t(k)] *
                std::fmax(0.0, figures[std::size_t(b * width + k)] - free[std::size_t(k)]);
    costs.push_back(cost);
    CHECK(reached[std::size_t(b)] == 1.0);

    Controller controller = plan.controller;
    controller.set_gains(gains.data() + b * GAINS);
    RunOf run(*robot, controller, plan.t, plan.rtol, "auto");
    std::vector<double> q, w;
    for (int k = 0; k < int(plan.t.size()); ++k) {
      const double *z =
          run.loop->record[0].state.data() + std::size_t(k * run.loop->record[0].size);
      q.push_back(z[0]), w.push_back(bend(*robot, run.work, z, 0).deflection);
    }
    double each[JOINT_FIGURES] = {}, of_strip[STRIP_FIGURES];
    const Samples at{plan.t.data(), int(plan.t.size())};
    joint_metrics(at, plan.reference.data(), q.data(), each);
    strip_metrics(at, w.data(), each[SETTLING], of_strip);
    for (int k = 0; k < EFFORT; ++k)
      CHECK(check::same_bits(each[k], figures[std::size_t(b * width + k)]));
    for (int k = 0; k < STRIP_FIGURES; ++k)
      CHECK(check::same_bits(of_strip[k], figures[std::size_t(b * width + JOINT_FIGURES + k)]));
  }
  for (double part : {0.3, 0.9, 1.0 - 1e-6, 1.0}) {
    for (int b = 0; b < rows; ++b) limits[std::size_t(b)] = part * costs[std::size_t(b)];
    trials.run(prices, gains.data(), limits.data(), rows, 2, again.data(), far.data());
    int early = 0;
    for (int b = 0; b < rows; ++b) {
      early += far[std::size_t(b)] < 1.0;
      double cost = 0.0;
      for (int k = 0; k < width; ++k)
        if (price[std::size_t(k)] > 0.0)
          cost += price[std::size_t(k)] *
                  std::fmax(0.0, again[std::size_t(b * width + k)] - free[std::size_t(k)]);
      if (part < 1.0)
        CHECK(cost > limits[std::size_t(b)]);
      else
        CHECK(far[std::size_t(b)] == 1.0 && check::same_bits(cost, costs[std::size_t(b)]));
    }
    if (part < 0.5) CHECK(early > rows / 2);
  }
}
