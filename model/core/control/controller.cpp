#include "control/controller.hpp"

#include <numeric>

namespace flexura {
namespace {

Segment standing(double t, double place) {
  return {t, {place, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
}

constexpr double LONG_AGO = -1e300;

}  // namespace

Controller::Controller(std::shared_ptr<const Model<double>> robot, std::vector<JointLaw> joints,
                       std::vector<Coupling> couplings, double rate_Hz, double quantum,
                       LinearLaw linear)
    : robot_(std::move(robot)), couplings_(std::move(couplings)) {
  law_.joints = std::move(joints), law_.linear = std::move(linear);
  law_.rate_Hz = rate_Hz, law_.quantum = quantum, law_.first = robot_->first;
}

void Controller::set_gains(const double *rows) {
  for (std::size_t i = 0; i < law_.joints.size(); ++i) {
    const double *g = rows + i * GAINS;
    JointLaw &joint = law_.joints[i];
    joint.gains.kp = g[KP], joint.gains.ki = g[KI], joint.gains.kd = g[KD], joint.gains.kf = g[KF],
    joint.gains.kg = g[KG];
    joint.ks = g[KS], joint.kt = g[KT], joint.gains.kv = g[KV], joint.gains.kc = g[KC];
    joint.inertia = g[JO], joint.damping = g[BO], joint.observer = g[OBSERVER];
    joint.gains.limit = g[LIMIT], joint.gains.slew = g[SLEW], joint.force_per_u = g[FORCE];
    joint.setpoint = g[SETPOINT], joint.derivative = g[DERIVATIVE], joint.count = g[COUNT],
    joint.duty = g[DUTY];
    joint.encoder = g[ENCODER] != 0.0, joint.rigid = g[RIGID] != 0.0, joint.delay = int(g[DELAY]);
  }
  law_.deflection = rows[DEFLECTION];
}

void Controller::start(Inputs &acting, const double *q) {
  const int link = last_flexible(*robot_);
  law_.strip = nullptr, law_.first = robot_->first;
  if (link >= 0)  // a workspace of this run's own: controllers are copied, one for each thread
    law_.strip = [robot = robot_.get(), work = std::make_shared<Workspace<double>>(*robot_),
                  link](const double *y) { return bend(*robot, *work, y, link); };
  law_.reset();
  acting.sampler = this, acting.rate_Hz = law_.rate_Hz;
  for (std::size_t i = 0; i < law_.joints.size(); ++i) {
    const JointLaw &joint = law_.joints[i];
    acting.held.force[i] = 0.0, acting.held.motion[i] = standing(0.0, q[robot_->first[i]]);
    if (joint.output == JointLaw::Output::none) continue;
    JointDrive &drive = acting.joints[i] = JointDrive();
    drive.kp = couplings_[i].stiffness, drive.kd = couplings_[i].damping;
    drive.sampled = joint.output == JointLaw::Output::stepper,
    drive.prescribed = drive.sampled && joint.rigid;
    if (!drive.sampled && drive.kd != 0.0) drive.motion = {standing(LONG_AGO, 0.0)};
  }
}

void Controller::step(long k, double t, const double *positions, const Bend &bend,
                      SampledOutput &held) {
  std::iota(law_.first.begin(), law_.first.end(), 0);
  law_.strip = [bend](const double *) { return bend; };
  law_.tick(k, t, positions, nullptr, held);
}

}  // namespace flexura
