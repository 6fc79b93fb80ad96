#include "controller.hpp"

namespace flexura {
namespace {

double rounded(double x, double quantum) { return quantum == 0.0 ? x : quantum * std::floor(x / quantum + 0.5); }

Segment standing(double t, double place) { return {t, {place, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0}; }

constexpr double LONG_AGO = -1e300;

}  // namespace

Controller::Controller(std::shared_ptr<const Model<double>> robot, std::vector<ControlledJoint> joints, double rate_Hz, double quantum,
                       LinearLaw linear)
    : robot_(std::move(robot)), joints_(std::move(joints)), rate_(rate_Hz), quantum_(quantum), strip_(last_bending(*robot_)),
      linear_(std::move(linear)), memory_(joints_.size()), positions_(joints_.size(), 0.0) {}

void Controller::set_gains(const double *rows) {
  for (ControlledJoint &joint : joints_) {
    std::copy(rows, rows + GAINS, joint.gain);
    rows += GAINS;
  }
}

void Controller::start(Acting &acting, const double *q) {
  acting.sampler = this, acting.rate_Hz = rate_;
  deflection_ = slope_ = Filtered();
  ticks_ = 0, log_.clear();
  linear_.start();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const ControlledJoint &joint = joints_[i];
    memory_[i] = Memory();
    memory_[i].ring.assign(std::size_t(joint.gain[DELAY]) + 1, 0.0);
    acting.held.force[i] = 0.0, acting.held.motion[i] = standing(0.0, q[robot_->first[i]]);
    if (joint.output == Output::none) continue;
    JointDrive &drive = acting.joints[i] = JointDrive();
    drive.kp = joint.stiffness, drive.kd = joint.damping;
    drive.sampled = joint.output == Output::stepper;
    drive.prescribed = drive.sampled && joint.gain[RIGID] != 0.0;
    if (!drive.sampled && joint.damping != 0.0) drive.motion = {standing(LONG_AGO, 0.0)};
  }
}

void Controller::tick(long k, double t, const double *q, const double *v, SampledOutput &held) {
  (void)v;
  for (std::size_t i = 0; i < joints_.size(); ++i) positions_[i] = q[robot_->first[i]];
  step(k, t, positions_.data(), strip_ < 0 ? Bend() : bend(*robot_, strip_, q), held);
}

void Controller::step(long k, double t, const double *positions, const Bend &bend, SampledOutput &held) {
  sense(k, bend);
  for (int i = 0; i < count(); ++i)
    if (joint(i).output != Output::none) calculate(i, k, t, positions[i]);
  if (linear_.present()) {
    linear_.estimate();
    for (int i = 0; i < count(); ++i) {
      if (joint(i).output == Output::none) continue;
      double wish = linear_.wish(i);
      for (int j = 0; j < count(); ++j) wish += linear_.follow(i, j, memory_[std::size_t(j)].reference, memory_[std::size_t(j)].setpoint_rate);
      const double *g = joint(i).gain;
      Reals::Gains limits;
      limits.limit = g[LIMIT], limits.slew = g[SLEW] / rate_;
      memory_[std::size_t(i)].law.follow(limits, wish + evaluate(joint(i).feedforward, t).y);
    }
  }
  log_.resize(log_.size() + joints_.size() * LOGGED, 0.0);
  for (int i = 0; i < count(); ++i)
    if (joint(i).output != Output::none) give(i, k, t, held);
  if (linear_.present()) {
    std::vector<double> all;
    for (const Memory &m : memory_) all.push_back(m.given);
    linear_.predict(all);
  }
  ticks_ = k + 1;
}

// The strip: readings of two ticks make a value, its filter and its rate.
void Controller::sense(long k, const Bend &bend) {
  const double w = rounded(bend.deflection, quantum_);
  if (linear_.measured > count()) linear_.measure(count(), w);
  smooth(k, w, deflection_);
  smooth(k, bend.slope, slope_);
}

void Controller::smooth(long k, double reading, Filtered &out) const {
  if (k == 0) out.before = out.value = reading;
  if (k % 2 == 0) {
    const double change = joints_.empty() ? 0.0 : joints_[0].gain[DEFLECTION] * (0.5 * (out.before + reading) - out.value);
    out.value += change;
    out.rate = change * (0.5 * rate_);
  }
  out.before = reading;
}

// Joint i's reference, and by the PID its output; of a linear law only what is measured.
void Controller::calculate(int i, long k, double t, double position) {
  const ControlledJoint &own = joint(i);
  const double *g = own.gain;
  Memory &m = memory_[std::size_t(i)];
  double q = rounded(position, g[COUNT]);
  if (k == 0) {
    m.position = q, m.pulses = m.place = position;
    m.reference = evaluate(own.reference, std::nextafter(t, LONG_AGO)).y;
  }
  const double change = g[SETPOINT] * (evaluate(own.reference, t).y - m.reference);
  m.reference += change;
  m.setpoint_rate = change * rate_;
  if (linear_.present()) return linear_.measure(i, q);
  m.speed += g[DERIVATIVE] * ((q - m.position) * rate_ - m.speed);
  m.position = q;
  double speed = m.speed;
  if (own.output == Output::stepper && g[ENCODER] == 0.0) q = m.pulses, speed = m.law.output();
  if (k % 2 == i % 2)
    m.tip = strip_term<Reals::Sum>(g[KF], g[KG], deflection_.value, deflection_.rate) +
            strip_term<Reals::Sum>(g[KS], g[KT], slope_.value, slope_.rate);
  const Reals::Gains gains{g[KP], g[KI] / rate_, g[KD], g[KV], g[KC], g[LIMIT], g[SLEW] / rate_};
  m.law.update(gains, Reals::Signals{m.reference - q, speed, m.setpoint_rate, m.tip + evaluate(own.feedforward, t).y});
}

// Joint i's output, after its delay, as what holds from t on.
void Controller::give(int i, long k, double t, SampledOutput &held) {
  const ControlledJoint &own = joint(i);
  const double *g = own.gain, T = 1.0 / rate_;
  Memory &m = memory_[std::size_t(i)];
  const long size = long(m.ring.size()), late = size - 1;
  m.ring[std::size_t(k % size)] = m.law.output();
  const double before = m.given;
  double given = k >= late ? m.ring[std::size_t((k - late) % size)] : 0.0;
  m.pulses += m.law.output() * T;
  double coefficient[3] = {0.0, 0.0, 0.0};
  if (own.output == Output::effort) {
    given = rounded(given, g[DUTY]);
    coefficient[0] = held.force[std::size_t(i)] = g[FORCE] * given;
  } else {
    coefficient[0] = m.place, coefficient[1] = given;
    if (g[RIGID] != 0.0) coefficient[1] = before, coefficient[2] = 0.5 * (given - before) * rate_;  // the rate changes evenly over a tick
    m.place += T * (coefficient[1] + coefficient[2] * T);
    held.motion[std::size_t(i)] = Segment{t, {coefficient[0], coefficient[1], coefficient[2], 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
  }
  m.given = given;
  double *row = log_.data() + log_.size() - (joints_.size() - std::size_t(i)) * LOGGED;
  row[0] = m.reference, row[1] = given, row[5] = deflection_.value;
  std::copy(coefficient, coefficient + 3, row + 2);
}

}  // namespace flexura
