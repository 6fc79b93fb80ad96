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
Plan carts(const char *method, double limit = INFINITE, bool both = false) {
  Robot robot;
  Link cart;
  cart.length = 0.0, cart.mass = 1.0, cart.joint.kind = JointKind::slider;
  robot.links = {cart, cart};
  auto model = std::make_shared<const Model<double>>(assemble(robot));
  std::vector<JointLaw> laws(2);
  laws[1].output = JointLaw::Output::force;
  laws[1].reference = {Segment{0.0, {0.1, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0}};
  if (both) laws[0] = laws[1];
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
      g[KP] = kp, g[KD] = kd, g[LIMIT] = limit, g[SLEW] = INFINITE;
      g[FORCE] = g[SETPOINT] = g[DERIVATIVE] = g[DEFLECTION] = 1.0;
    }
  }
};

struct Found {
  double figures[WIDTH] = {}, reached = 0.0;
  const double *joint(int i) const { return figures + i * JOINT_FIGURES; }
};

Found found(const Plan &plan, const Gains &row, double most = INFINITE, double vibration = 1.0) {
  double price[WIDTH] = {}, free[WIDTH] = {};
  price[JOINT_FIGURES + ITAE] = price[JOINT_FIGURES + OVERSHOOT] = 1.0;
  price[JOINT_FIGURES + EFFORT] = 0.01, price[2 * JOINT_FIGURES + VIBRATION] = vibration;
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
  const Found both = found(carts("auto", INFINITE, true), Gains(1.0, 0.0, INFINITE));
  for (int i = 0; i < JOINTS; ++i) CHECK(std::isnan(both.joint(i)[SETTLING]));
  for (double most : {INFINITE, 1e3}) {
    const Found stopped = found(carts("auto", 0.05), Gains(400.0, 30.0, INFINITE), most);
    CHECK(0.0 < stopped.reached && stopped.reached < 1.0);
    for (double figure : stopped.figures) CHECK(std::isnan(figure));
  }
}

TEST("a row that costs too much is given up with lower bounds") {
  const Gains row(400.0, 30.0, 50.0);
  const Found whole = found(carts("auto"), row), part = found(carts("auto"), row, 1e-3, 0.0);
  CHECK(part.reached < 1.0 && part.joint(1)[ITAE] > 0.0);
  CHECK(part.joint(1)[ITAE] <= whole.joint(1)[ITAE]);
  const Found both = found(carts("auto"), row, 1e-3, 1.0);  // whose vibration has a price, too
  CHECK(both.reached == part.reached && both.joint(1)[ITAE] == part.joint(1)[ITAE]);
}

TEST("two rows by two threads are those of each alone") {
  const Gains one(400.0, 30.0, 50.0), two(300.0, 20.0, 50.0);
  std::vector<double> rows(one.rows, one.rows + JOINTS * GAINS);
  rows.insert(rows.end(), two.rows, two.rows + JOINTS * GAINS);
  const double price[WIDTH] = {}, limits[2] = {INFINITE, INFINITE};
  double figures[2 * WIDTH] = {}, reached[2] = {};
  GainSweep sweep(carts("auto"));
  sweep.run({price, price}, rows.data(), limits, 2, 2, figures, reached);
  for (int k = 0; k < 2; ++k) {
    const Found alone = found(carts("auto"), k ? two : one);
    CHECK(reached[k] == 1.0);
    for (int f = 0; f < WIDTH; ++f)
      CHECK(check::same_bits(figures[k * WIDTH + f], alone.figures[f]));
  }
}
