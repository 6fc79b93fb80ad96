// The methods on robots: known motions, the balance of energies, packs.
#include <string>

#include "check.hpp"
#include "control/model_plant.hpp"
#include "energy_balance.hpp"
#include "integration/time_loop.hpp"
#include "link/assembly.hpp"
#include "simulation/method_by_name.hpp"

using namespace flexura;

namespace {

Link bar(double length, double stiffness, double mass, int elements, double hub = 0.0) {
  Link link;
  link.length = length, link.elements = elements;
  link.material = {Interval{0.0, length, {mass, 0.0, 0.0}, {stiffness, 0.0, 0.0, 0.0, 0.0}}};
  link.joint.hub_inertia = hub, link.joint.low = -1e3, link.joint.high = 1e3;
  return link;
}
Segment segment(double t0, double c0, double c1 = 0.0) {
  return {t0, {c0, c1, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}
std::vector<double> grid(double end, int count) {
  std::vector<double> t;
  for (int k = 0; k < count; ++k) t.push_back(end * k / (count - 1));
  return t;
}

struct RunOf {
  Model<double> model;
  Workspace<double> work;
  ModelPlant<double> plant;
  Loop<double> loop;
  std::unique_ptr<Method<double>> method;
  std::vector<Pose<double>> pose;
  RunOf(const Robot &robot, Inputs *acting, std::vector<double> t, double rtol,
        const std::string &name)
      : model(assemble(robot)),
        work(model),
        plant(model, work),
        loop(plant, &acting, std::move(t), rtol),
        method(make_method(name, loop.integration)),
        pose(std::size_t(model.links()) + 1) {}
  Status operator()(std::vector<double> q = {}) {
    q.resize(std::size_t(model.n), 0.0);
    std::vector<double> v(std::size_t(model.n), 0.0);
    loop.start(q.data(), v.data(), 1e-4);
    loop.most_steps = 200000;
    while (loop.advance(*method, 1000)) {
    }
    return loop.run_state[0].status;
  }
  const double *state(int row) const {
    return loop.record[0].state.data() + std::size_t(row * loop.record[0].size);
  }
  const Pose<double> &tip(int row) {
    double rate[2];
    const double *y = state(row), *v = y + model.n;
    outward_kinematics(model, work, y, v);
    hub_poses(model, work, y, v, pose.data(), rate);
    return pose.back();
  }
  Energies<double> energy(int row) {
    return energies(model, work, state(row), state(row) + model.n);
  }
  // The largest gap in the balance over the largest energy.
  double balance() {
    const Energies<double> begun = energy(0);
    double gap = 0.0, most = 0.0;
    for (int row = 1; row < loop.record[0].rows; ++row) {
      const Energies<double> now = energy(row);
      const double *accounts = state(row) + 2 * model.n;
      gap = std::fmax(gap, std::fabs(missing_energy(begun, now, accounts)));
      gap = std::fmax(gap, 0.1 * std::fabs(missing_strain(begun, now, accounts)));
      most = std::fmax(most, std::fmax(now.kinetic + now.strain, std::fabs(accounts[WORK])));
    }
    return gap / most;
  }
};

const char *const NAMES[] = {"explicit", "implicit"};

}  // namespace

TEST("a flexible pendulum without a hub, released straight and horizontal") {
  Robot robot;
  robot.gravity[1] = -9.81;
  robot.links = {bar(1.0, 0.5, 0.5, 8)};
  for (const char *name : NAMES) {
    Inputs acting(1);
    RunOf run(robot, &acting, grid(1.0, 5), 1e-4, name);
    CHECK(run() == Status::done);
    CHECK_NEAR(run.tip(1).x, 0.90890, 2e-4), CHECK_NEAR(run.tip(1).y, -0.40750, 2e-4);
    CHECK_NEAR(run.tip(2).x, -0.06008, 2e-4), CHECK_NEAR(run.tip(2).y, -0.99609, 2e-4);
    CHECK_NEAR(run.tip(4).x, -0.98757, 5e-4), CHECK_NEAR(run.tip(4).y, 0.05182, 5e-4);
    CHECK_NEAR(run.balance(), 0.0, 1e-5);
  }
}

TEST("the torque-driven bench arm") {
  Robot robot;
  robot.links = {bar(0.6, 0.5, 0.2355, 8, 2e-3)};
  robot.payload_mass = 0.05;
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, 0.05), segment(0.5, -0.05), segment(1.0, 0.0)};
  RunOf run(robot, &acting, grid(2.0, 9), 1e-4, "implicit");
  CHECK(run() == Status::done);
  const double angle[] = {0.0, 0.06110, 0.19744, 0.26326, 0.28841},
               deflection[] = {0.0, -0.012954, -0.019457, 0.022566, 0.034247};
  for (int k = 1; k < 5; ++k) {
    const Pose<double> tip = run.tip(k);
    const double a = run.state(k)[0];
    CHECK_NEAR(a, angle[k], 1e-4);
    CHECK_NEAR(std::cos(a) * tip.y - std::sin(a) * tip.x, deflection[k], 1e-4);
  }
  CHECK_NEAR(run.state(8)[0], 0.33200, 1e-4);
  CHECK_NEAR(run.balance(), 0.0, 1e-4);
}

TEST("the balance of sliders, sleeves, dampers and friction; a broken account shows") {
  Robot robot;
  robot.gravity[1] = -2.0;
  robot.links = {bar(1.0, 20.0, 0.5, 4), bar(0.6, 5.0, 0.3, 4, 0.01), bar(0.8, 8.0, 0.3, 4)};
  for (Link &link : robot.links)
    link.beta = 2e-4, link.alpha = 0.1, link.joint.viscous = 0.2, link.joint.coulomb = 0.05;
  robot.links[1].joint.kind = JointKind::slider, robot.links[1].joint.angle = 0.5;
  robot.links[1].joint.hub_mass = 0.1;
  robot.links[2].joint.kind = JointKind::sleeve, robot.links[2].joint.hub_mass = 0.1,
  robot.links[2].joint.hub_inertia = 1e-3;
  robot.payload_mass = 0.1;
  for (Link &link : robot.links) link.joint.rotor = 0.01;
  robot.links[1].joint.start = robot.links[2].joint.start = 0.5;
  Inputs acting(3);
  const double at[] = {0.2, 0.5, 0.5};
  for (int i = 0; i < 3; ++i) {
    acting.joints[std::size_t(i)].motion = {segment(0.0, at[i], 0.2)};
    acting.joints[std::size_t(i)].kp = 30.0, acting.joints[std::size_t(i)].kd = 3.0;
  }
  RunOf run(robot, &acting, grid(0.5, 11), 1e-5, "implicit");
  std::vector<double> q(std::size_t(run.model.n), 0.0);
  for (int i = 0; i < 3; ++i) q[std::size_t(run.plant.first[std::size_t(i)])] = at[i];
  CHECK(run(q) == Status::done);
  CHECK_NEAR(run.balance(), 0.0, 1e-4);
  CHECK(run.state(10)[2 * run.model.n + LOSS] > 1e-3);
  Record &record = run.loop.record[0];
  for (int row = 0; row < record.rows; ++row)
    record.state[std::size_t(row * record.size + 2 * run.model.n + LOSS)] *= 1.4;
  CHECK(run.balance() > 1e-3);
}

TEST("four robots side by side have the digits of each alone") {
  Robot robots[4];
  Model<double> one[4];
  const Model<double> *list[4];
  std::vector<Inputs> acting(4, Inputs(2));
  Inputs *acts[4];
  for (int k = 0; k < 4; ++k) {
    robots[k].links = {bar(0.5 + 0.05 * k, 1.0, 0.2, 3, 0.05), bar(0.5, 1.0 + k, 0.2, 2, 0.02)};
    robots[k].payload_mass = 0.1 * k;
    for (Link &link : robots[k].links) link.beta = 1e-3, link.joint.coulomb = k == 2 ? 0.01 : 0.0;
    one[k] = assemble(robots[k]), list[k] = &one[k];
    acting[std::size_t(k)].joints[0].force = {segment(0.0, 0.2), segment(0.1 + 0.02 * k, -0.2)};
    acts[k] = &acting[std::size_t(k)];
  }
  Model<Pack<4>> model = pack(list);
  Workspace<Pack<4>> work(model);
  ModelPlant<Pack<4>> plant(model, work);
  for (bool given : {false, true})
    for (const char *name : NAMES) {
      for (Inputs &each : acting) {
        each.joints[1].motion = {segment(0.0, 0.0, 0.5)}, each.joints[1].prescribed = given;
        each.joints[1].kp = 2.0;
      }
      Loop<Pack<4>> loop(plant, acts, grid(0.2, 11), 1e-4);
      std::unique_ptr<Method<Pack<4>>> method = make_method(name, loop.integration);
      std::vector<Pack<4>> zero(std::size_t(model.n), Pack<4>(0.0));
      loop.start(zero.data(), zero.data(), 1e-3);
      while (loop.advance(*method, 1000)) {
      }
      for (int k = 0; k < 4; ++k) {
        RunOf run(robots[k], acts[k], grid(0.2, 11), 1e-4, name);
        const std::vector<double> still(std::size_t(model.n), 0.0);
        run.loop.start(still.data(), still.data(), 1e-3);
        while (run.loop.advance(*run.method, 1000)) {
        }
        CHECK(run.loop.run_state[0].steps == loop.run_state[std::size_t(k)].steps &&
              run.loop.run_state[0].status == Status::done);
        bool same = loop.record[std::size_t(k)].rows == run.loop.record[0].rows;
        for (int j = 0; same && j < 11 * run.loop.record[0].size; ++j)
          same = check::same_bits(run.loop.record[0].state[std::size_t(j)],
                                  loop.record[std::size_t(k)].state[std::size_t(j)]);
        CHECK(same);
      }
    }
}

TEST("a robot that stands still, with a locked joint, takes long steps") {
  Robot robot;
  robot.links = {bar(1.0, 1.0, 0.5, 4), bar(1.0, 1.0, 0.5, 4)};
  robot.links[1].joint.locked = true;
  for (const char *name : NAMES) {
    Inputs acting(2);
    RunOf run(robot, &acting, grid(1.0, 3), 1e-6, name);
    CHECK(run() == Status::done);
    CHECK(run.state(2)[0] == 0.0 && run.state(2)[run.model.n - 1] == 0.0);
  }
}
