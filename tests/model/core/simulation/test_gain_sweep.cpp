// Rows of gains that fail, that are given up, and joints that are not the controller's.
#include "simulation/gain_sweep.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "check.hpp"
#include "link/assembly.hpp"

using namespace flexura;

namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();
constexpr int JOINTS = 2, WIDTH = JOINT_FIGURES * JOINTS + STRIP_FIGURES;

// Two carts, one on the other; the controller has the second, a spring of the drive's the first.
Plan carts(const char *method, double limit = INFINITE) {
  Robot robot;
  Link cart;
  cart.length = 0.0, cart.mass = 1.0, cart.joint.kind = JointKind::slider;
  robot.links = {cart, cart};
  auto model = std::make_shared<const Model<double>>(assemble(robot));
  std::vector<JointLaw> laws(2);
  laws[1].output = JointLaw::Output::force;
  laws[1].reference = {Segment{0.0, {0.1, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0}};
  Controller controller(model, laws, {Coupling(), Coupling()}, 1000.0, 0.0, LinearLaw());
  Inputs acting(2);
  acting.joints[0].motion = {Segment{0.0, {0.0}, 0.0, 0.0, 0.0}};
  acting.joints[0].kp = 1e3, acting.joints[0].kd = 30.0;
  acting.limit(1, -limit, limit);
  std::vector<double> t, reference(2 * 201, 0.0);
  for (int k = 0; k <= 200; ++k) t.push_back(0.005 * k), reference[std::size_t(201 + k)] = 0.1;
  return {model, acting, controller, t, {0.0, 0.0}, reference, 1e-6, method};
}

struct Gains {
  double rows[JOINTS * GAINS] = {};
  Gains(double kp, double kd, double limit) {
    for (int i = 0; i < JOINTS; ++i) {
      double *g = rows + i * GAINS;
      g[LIMIT] = limit, g[SLEW] = INFINITE;
      g[FORCE] = g[SETPOINT] = g[DERIVATIVE] = g[DEFLECTION] = 1.0;
    }
    rows[GAINS + KP] = kp, rows[GAINS + KD] = kd;
  }
};

struct Found {
  double figures[WIDTH] = {}, reached = 0.0;
  const double *joint(int i) const { return figures + i * JOINT_FIGURES; }
};

Found found(const Plan &plan, const Gains &row, double most = INFINITE) {
  double price[WIDTH] = {}, free[WIDTH] = {};
  price[JOINT_FIGURES + ITAE] = price[JOINT_FIGURES + OVERSHOOT] = 1.0;
  price[JOINT_FIGURES + EFFORT] = 0.01;
  Found out;
  GainSweep sweep(plan);
  sweep.run({price, free}, row.rows, &most, 1, 1, out.figures, &out.reached);
  return out;
}

}  // namespace

TEST("there is no method of another name") {
  bool refused = false;
  try {
    const GainSweep sweep(carts("euler"));
  } catch (const std::invalid_argument &) {
    refused = true;
  }
  CHECK(refused);
  CHECK(GainSweep(carts("implicit")).plan().method == "implicit");
}

TEST(
    "a joint that is not the controller's has no figures, a robot that does not bend no "
    "vibration") {
  for (double limit : {INFINITE, 50.0})
    for (double most : {INFINITE, 1e3}) {
      const Found row = found(carts("auto"), Gains(400.0, 30.0, limit), most);
      CHECK(row.reached == 1.0);
      for (int k = 0; k < JOINT_FIGURES; ++k) CHECK(std::isnan(row.joint(0)[k]));
      CHECK(row.joint(1)[RISE] > 0.0 && row.joint(1)[SETTLING] < 1.0);
      CHECK((row.joint(1)[EFFORT] > 0.0) == std::isfinite(limit));
      CHECK(row.figures[2 * JOINT_FIGURES + VIBRATION] == 0.0);
    }
}

TEST("a row that does not settle has no settling; one that meets a limit has no figures") {
  const Found weak = found(carts("auto"), Gains(1.0, 0.0, INFINITE));
  CHECK(weak.reached == 1.0 && std::isnan(weak.joint(1)[SETTLING]));
  for (double most : {INFINITE, 1e3}) {
    const Found stopped = found(carts("auto", 0.05), Gains(400.0, 30.0, INFINITE), most);
    CHECK(0.0 < stopped.reached && stopped.reached < 1.0);
    for (double figure : stopped.figures) CHECK(std::isnan(figure));
  }
}

TEST("a row that costs too much is given up with lower bounds") {
  const Gains row(400.0, 30.0, 50.0);
  const Found whole = found(carts("auto"), row), part = found(carts("auto"), row, 1e-3);
  CHECK(part.reached < 1.0 && part.joint(1)[ITAE] > 0.0);
  CHECK(part.joint(1)[ITAE] <= whole.joint(1)[ITAE]);
}
