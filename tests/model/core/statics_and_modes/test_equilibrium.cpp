// Static equilibrium: the elastica, roll-ups, buckling, and the forces of any robot in balance.
#include "statics_and_modes/equilibrium.hpp"

#include "check.hpp"
#include "dynamics/inverse_dynamics.hpp"
#include "link/assembly.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

constexpr double pi = 3.14159265358979324;

Link strip(double length, double mass, double stiffness, int elements) {
  Link link;
  link.length = length, link.elements = elements;
  Interval all;
  all.to = length, all.mass[0] = mass, all.stiffness[0] = stiffness;
  link.material = {all};
  return link;
}

Model<double> cantilever(int elements, int modes = -1) {
  Robot robot;
  robot.links = {strip(1.0, 1.0, 1.0, elements)};
  robot.links[0].modes = modes;
  return assemble(robot);
}

// The elastica by Runge-Kutta and the secant method: theta'' = -P cos theta, theta(0) = 0,
// theta'(1) = 0; x, y, theta of the tip.
void elastica(double P, double tip[3]) {
  const int steps = 4000;
  auto shoot = [&](double curvature, double out[3]) {
    double z[4] = {0.0, 0.0, 0.0, curvature};  // x, y, theta, theta'
    auto slope = [&](const double *s, double *d) {
      d[0] = std::cos(s[2]), d[1] = std::sin(s[2]), d[2] = s[3], d[3] = -P * std::cos(s[2]);
    };
    for (int k = 0; k < steps; ++k) {
      double a[4], b[4], c[4], d[4], w[4];
      const double h = 1.0 / steps;
      slope(z, a);
      for (int i = 0; i < 4; ++i) w[i] = z[i] + 0.5 * h * a[i];
      slope(w, b);
      for (int i = 0; i < 4; ++i) w[i] = z[i] + 0.5 * h * b[i];
      slope(w, c);
      for (int i = 0; i < 4; ++i) w[i] = z[i] + h * c[i];
      slope(w, d);
      for (int i = 0; i < 4; ++i) z[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
    }
    for (int i = 0; i < 3; ++i) out[i] = z[i];
    return z[3];
  };
  double low = 0.0,
         high =
             P;  // the curvature at the root is P x_tip: between these, and theta'(1) rises with it
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (shoot(middle, tip) > 0.0 ? high : low) = middle;
  }
}

// Slope a of the tip of a column under `share` of its buckling load: K(sin a/2) = sqrt(share) pi/2,
// K by the arithmetic-geometric mean.
double buckled_slope(double share) {
  double low = 0.0, high = pi;
  for (int k = 0; k < 60; ++k) {
    const double a = 0.5 * (low + high);
    double x = 1.0, y = std::cos(0.5 * a);
    for (int turn = 0; turn < 8; ++turn) {
      const double mean = 0.5 * (x + y);
      y = std::sqrt(x * y), x = mean;
    }
    (1.0 / x > std::sqrt(share) ? high : low) = a;
  }
  return low;
}

// The largest static force on what may move at q, by inverse dynamics at rest.
double out_of_balance(const Model<double> &model, const Numbers &q, const char *free) {
  Workspace<double> work(model);
  Numbers zero(model.n, 0.0), force(model.n);
  forces(model, work, q.data(), zero.data(), zero.data(), Terms{}, force.data());
  for (int i = 0; i < model.links(); ++i)
    if (!free || !free[i]) force[model.first[i]] = 0.0;
  double worst = 0.0;
  for (double f : force) worst = std::fmax(worst, std::fabs(f));
  return worst;
}

}  // namespace

TEST("elastica, 8 elements: tip and slope at P L^2/EI = 1, 2, 5, 10 to 1e-5 L, 25 to 3e-5 L") {
  const Model<double> model = cantilever(8);
  for (double P : {1.0, 2.0, 5.0, 10.0, 25.0, -10.0}) {
    Numbers q(model.n, 0.0);
    TipLoad load;
    load.force[1] = P;
    const Equilibrium found = equilibrium(model, q.data(), load);
    double exact[3];
    elastica(std::fabs(P), exact);
    CHECK(found.balance == Balance::stable && found.share == 1.0);
    const double within = std::fabs(P) > 10.0 ? 3e-5 : 1e-5, side = P > 0.0 ? 1.0 : -1.0;
    CHECK_NEAR(found.tip.x, exact[0], within);
    CHECK_NEAR(found.tip.y, side * exact[1], within);
    CHECK_NEAR(found.tip.t, side * exact[2], within);
  }
  double known[3];
  elastica(10.0, known);
  CHECK_NEAR(known[1], 0.810609, 5e-7);
  CHECK_NEAR(known[2], 1.430286, 5e-7);
}

TEST("elastica by a whole link's own modes") {
  const Model<double> model = cantilever(8, 8);
  Numbers q(model.n, 0.0);
  TipLoad load;
  load.force[1] = 5.0;
  const Equilibrium found = equilibrium(model, q.data(), load);
  CHECK(found.balance == Balance::stable);
  CHECK_NEAR(found.tip.y, 0.713792, 2e-5);
}

TEST("a moment 2 pi EI/L rolls the strip into a ring, 4 pi EI/L twice") {
  for (int elements : {1, 2, 8, 64})
    for (double turns : {1.0, -2.0}) {
      if (elements < 3 * std::fabs(turns) && elements > 2) continue;
      const Model<double> model = cantilever(elements);
      Numbers q(model.n, 0.0);
      TipLoad load;
      load.moment = 2.0 * pi * turns;
      const Equilibrium found = equilibrium(model, q.data(), load);
      CHECK(found.balance == Balance::stable);
      CHECK_NEAR(found.tip.t, 2.0 * pi * turns, 1e-10);
      if (elements < 8) continue;  // fewer elements turn by more than three points see
      CHECK_NEAR(found.tip.x, 0.0, 1e-10);
      CHECK_NEAR(found.tip.y, 0.0, 1e-10);
    }
}

TEST("buckling: pi^2 EI/(4 L^2) is borne, more is not; an imperfect column bends as the elastica") {
  for (int elements : {4, 16}) {
    const Model<double> model = cantilever(elements);
    Numbers q(model.n, 0.0);
    TipLoad load;
    load.force[0] = -pi * pi / 4.0 * (1.0 - 1e-3);
    CHECK(equilibrium(model, q.data(), load).balance == Balance::stable);
    load.force[0] = -5.0;
    const Equilibrium lost = equilibrium(model, q.data(), load);
    CHECK(lost.balance == Balance::unstable);
    CHECK_NEAR(5.0 * lost.share, pi * pi / 4.0, elements == 4 ? 1e-4 : 2e-5);
    for (double value : q) CHECK(value == 0.0);
    load.force[0] = -1.3 * pi * pi / 4.0, load.force[1] = 1e-4;  // bent, it bears more
    const Equilibrium bent = equilibrium(model, q.data(), load);
    CHECK(bent.balance == Balance::stable);
    CHECK_NEAR(bent.tip.t, buckled_slope(1.3), elements == 4 ? 1e-3 : 2e-4);
  }
}

TEST(
    "a load that cannot be borne is not confused with one that is not found; a guess chooses the "
    "branch") {
  const Model<double> model = cantilever(8);
  Numbers q(model.n, 0.0);
  TipLoad load;
  load.force[0] = -3.0;
  CHECK(equilibrium(model, q.data(), load).balance == Balance::unstable);
  for (int e = 0; e < 8; ++e) q[1 + 2 * e] = -0.15;  // bent to the right
  const Equilibrium right = equilibrium(model, q.data(), load);
  CHECK(right.balance == Balance::stable && right.tip.y < -0.1);
  load.force[0] = std::nan("");
  CHECK(equilibrium(model, q.data(), load).balance == Balance::missing);
}

TEST("gravity sag of soft links: forces in balance at any softness, by inverse dynamics") {
  for (double stiffness : {10.0, 1.0, 0.1, 0.01}) {
    Robot robot;
    robot.gravity[1] = -9.81;
    robot.links = {strip(0.7, 0.5, stiffness, 8), strip(0.5, 0.3, 0.7 * stiffness, 6)};
    robot.links[1].joint.hub_mass = 0.1, robot.payload_mass = 0.05, robot.payload_inertia = 1e-3;
    const Model<double> model = assemble(robot);
    Numbers q(model.n, 0.0);
    q[0] = 0.4, q[model.first[1]] = -0.9;
    const Equilibrium found = equilibrium(model, q.data());
    CHECK(found.balance == Balance::stable);
    CHECK_NEAR(out_of_balance(model, q, nullptr), 0.0, 2e-12);
    CHECK(q[0] == 0.4 && q[model.first[1]] == -0.9);
  }
}

TEST("sliders, sleeves, rigid links, modes: held, and in balance") {
  Robot robot;
  robot.gravity[0] = 2.0, robot.gravity[1] = -7.0;
  Link carriage, slender = strip(0.5, 0.4, 0.8, 4), rider = strip(0.4, 0.2, 0.3, 3),
                 sleeved = strip(0.6, 0.3, 0.5, 3), last = strip(0.3, 0.2, 0.2, 4);
  carriage.length = 0.1, carriage.mass = 0.6, carriage.centre = 0.05, carriage.inertia = 5e-4,
  carriage.joint.kind = JointKind::slider;
  rider.joint.kind = JointKind::slider, rider.joint.angle = 1.1, rider.joint.hub_mass = 0.2,
  rider.joint.hub_inertia = 1e-4;
  sleeved.joint.kind = JointKind::sleeve, sleeved.joint.angle = -0.6, sleeved.joint.start = 0.4,
  sleeved.joint.hub_mass = 0.1;
  last.joint.hub_inertia = 1e-4, last.modes = 3;
  for (int order = 0; order < 3; ++order) {
    robot.links = order == 0   ? std::vector<Link>{carriage, slender, rider, sleeved}
                  : order == 1 ? std::vector<Link>{slender, sleeved, rider, last}
                               : std::vector<Link>{slender, sleeved, last};
    robot.payload_mass = 0.07, robot.payload_inertia = 2e-4;
    const Model<double> model = assemble(robot);
    Numbers q(model.n, 0.0);
    for (int i = 0; i < model.links(); ++i) {
      const JointKind kind = model.kind[i];
      q[model.first[i]] = kind == JointKind::revolute ? 0.3 * i + 0.2
                          : kind == JointKind::slider ? 0.31
                                                      : 0.37;
    }
    const Equilibrium found = equilibrium(model, q.data());
    CHECK(found.balance == Balance::stable);
    CHECK_NEAR(out_of_balance(model, q, nullptr), 0.0, 1e-11);
    CHECK(found.sweeps < 20);
  }
}

TEST(
    "joints free to turn: a soft chain hangs down; a massless joint that nothing turns "
    "stays") {
  Robot robot;
  robot.gravity[1] = -9.81;
  robot.links = {strip(0.7, 0.5, 1.0, 4), strip(0.5, 0.3, 0.5, 4)};
  const Model<double> model = assemble(robot);
  const char free[2] = {1, 1}, second[2] = {0, 1};
  Numbers q(model.n, 0.0);
  q[0] = 0.3, q[model.first[1]] = 0.5;
  const Equilibrium found = equilibrium(model, q.data(), {}, free);
  CHECK(found.balance == Balance::stable);
  CHECK_NEAR(found.tip.x, 0.0, 1e-9);
  CHECK_NEAR(found.tip.y, -1.2, 1e-9);
  Numbers half(model.n, 0.0);
  half[0] = 0.3;
  CHECK(equilibrium(model, half.data(), {}, second).balance == Balance::stable);
  CHECK(half[0] == 0.3);
  CHECK_NEAR(out_of_balance(model, half, second), 0.0, 1e-10);
}

TEST("a robot without elastic unknowns, and one without load, are where they are") {
  Robot robot;
  Link arm;
  arm.length = 1.0, arm.mass = 1.0, arm.inertia = 0.1;
  robot.links = {arm};
  const Model<double> rigid = assemble(robot), soft = cantilever(4);
  Numbers q(1, 0.7), z(soft.n, 0.0);
  const Equilibrium found = equilibrium(rigid, q.data());
  CHECK(found.balance == Balance::stable && q[0] == 0.7);
  CHECK_NEAR(found.tip.x, std::cos(0.7), 1e-15);
  CHECK(equilibrium(soft, z.data()).balance == Balance::stable);
  for (double value : z) CHECK(value == 0.0);
}

TEST("loads beyond all measure: missing, not found by chance") {
  const Model<double> model = cantilever(8);
  TipLoad load;
  load.force[1] = 1e14;
  Numbers q(model.n, 0.0);
  const Equilibrium far = equilibrium(model, q.data(), load);
  CHECK(far.balance == Balance::missing && far.share == 0.0);
  for (double value : q) CHECK(value == 0.0);
  const char free[1] = {1};
  load.force[1] = std::nan("");
  CHECK(equilibrium(model, q.data(), load, free).balance == Balance::missing);
}

TEST("a pendulum that stands on its head is unstable, to the bit; beside it, it falls") {
  Robot robot;
  robot.gravity[0] = -9.81;  // towards the joint
  Link rod;
  rod.length = 1.0, rod.mass = 1.0, rod.centre = 0.5, rod.inertia = 0.1;
  robot.links = {rod};
  const Model<double> model = assemble(robot);
  const char free[1] = {1};
  Numbers q(model.n, 0.0);
  CHECK(equilibrium(model, q.data(), {}, free).balance == Balance::unstable && q[0] == 0.0);
  q[0] = 1e-3;
  CHECK(equilibrium(model, q.data(), {}, free).balance == Balance::stable);
  CHECK_NEAR(std::fabs(q[0]), pi, 1e-9);
}

TEST("a strip drawn far: the first integral of the elastica, at any force") {
  for (double P : {100.0, 1e3, 1e4}) {
    const Model<double> model = cantilever(64);
    TipLoad load;
    load.force[1] = P;
    Numbers q(model.n, 0.0);
    const Equilibrium found = equilibrium(model, q.data(), load);
    CHECK(found.balance == Balance::stable);
    // far from the clamp the strip is straight: its tip is 1 - (2 - sqrt 2) / sqrt P away from it
    CHECK_NEAR(found.tip.y, 1.0 - (2.0 - std::sqrt(2.0)) / std::sqrt(P), 1e-3);
    CHECK_NEAR(found.tip.t, 0.5 * pi, 1e-3);
  }
}

TEST(
    "a load that takes many Newton steps: what is found is in balance, a search from there stays") {
  const Model<double> model = cantilever(4);
  TipLoad load;
  load.force[1] = 1e5, load.moment = 50.0;
  Numbers q(model.n, 0.0);
  const Equilibrium found = equilibrium(model, q.data(), load);
  CHECK(found.balance == Balance::stable && found.sweeps > 20);
  const Numbers there = q;
  const Equilibrium again = equilibrium(model, q.data(), load);
  CHECK(again.balance == Balance::stable && again.sweeps <= 2);
  for (std::size_t i = 0; i < q.size(); ++i) CHECK_NEAR(q[i], there[i], 1e-9);
}
