#include "control/control_law.hpp"

#include <cmath>
#include <limits>

namespace flexura {
namespace {

double rounded(double x, double quantum) {
  return quantum == 0.0 ? x : quantum * std::floor(x / quantum + 0.5);
}

// sum_b A_(row, b) x_b of a matrix with `columns` columns.
double times_row(const std::vector<double> &A, std::size_t row, const double *x,
                 std::size_t columns) {
  double sum = 0.0;
  for (std::size_t b = 0; b < columns; ++b) sum += A[row * columns + b] * x[b];
  return sum;
}

}  // namespace

template class PidOf<ModelNumbers>;

void ControlLaw::reset() {
  memory_.assign(joints.size(), Memory());
  for (std::size_t i = 0; i < joints.size(); ++i)
    memory_[i].ring.assign(std::size_t(joints[i].delay) + 1, 0.0);
  predicted_.assign(std::size_t(linear.states), 0.0), estimated_ = predicted_;
  measured_.assign(std::size_t(linear.measurements), 0.0);
  before_ = filtered_ = rate_ = Bend();
  log.clear();
}

void ControlLaw::tick(long k, double t, const double *q, const double *, SampledOutput &held) {
  if (k == 0) reset();
  sense(k, q);
  for (std::size_t i = 0; i < joints.size(); ++i)
    if (joints[i].output != JointLaw::Output::none) measure(k, t, i, q);
  if (linear.states > 0) estimate();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].output != JointLaw::Output::none) {
      memory_[i].u = linear.states > 0 ? linear_output(t, i) : pid_output(k, t, i);
      give(k, t, i, held);
    } else {
      log.push_back(Tick{});
    }
  }
  if (linear.states > 0) predict();
}

// The strip: readings of two ticks make a value, its filter and its rate (69).
void ControlLaw::sense(long k, const double *q) {
  if (!strip) return;
  Bend now = strip(q);
  now.deflection = rounded(now.deflection, quantum);
  if (measured_.size() > joints.size())
    measured_[joints.size()] = now.deflection - linear.offset[joints.size()];
  if (k == 0) before_ = filtered_ = now;
  if (k % 2 == 0) {
    const double dw =
        deflection * (0.5 * (before_.deflection + now.deflection) - filtered_.deflection);
    const double ds = deflection * (0.5 * (before_.slope + now.slope) - filtered_.slope);
    filtered_.deflection += dw, filtered_.slope += ds;
    rate_ = {0.5 * rate_Hz * dw, 0.5 * rate_Hz * ds};
  }
  before_ = now;
}

// Reference, place and velocity of joint i (68).
void ControlLaw::measure(long k, double t, std::size_t i, const double *q) {
  const JointLaw &joint = joints[i];
  Memory &m = memory_[i];
  const double exact = q[first[i]], place = rounded(exact, joint.count);
  if (k == 0) {
    m.q = place, m.pulses = m.place = exact;
    m.reference =
        evaluate(joint.reference, std::nextafter(t, -std::numeric_limits<double>::infinity())).y;
  }
  const double step = joint.setpoint * (evaluate(joint.reference, t).y - m.reference);
  m.reference += step, m.reference_rate = step * rate_Hz;
  m.rate += joint.derivative * ((place - m.q) * rate_Hz - m.rate);
  m.q = place;
  if (linear.states > 0) measured_[i] = place - linear.offset[i];
}

GainsOf<ModelNumbers> ControlLaw::a_tick(const JointLaw &joint) const {
  GainsOf<ModelNumbers> g = joint.gains;
  g.ki /= rate_Hz, g.slew /= rate_Hz;
  return g;
}

// The nominal joint as its observer takes it (148).
ObserverGainsOf<ModelNumbers> ControlLaw::nominal(const JointLaw &joint) const {
  ObserverGainsOf<ModelNumbers> g;
  g.filter = joint.observer;
  g.inertia = 0.5 * rate_Hz * joint.inertia * joint.observer / (1.0 - joint.observer);
  g.moving = g.inertia - joint.damping;
  return g;
}

// The extended PID (70) with its limits (71) and anti-windup (72), and the observer's d^ (150).
double ControlLaw::pid_output(long k, double t, std::size_t i) {
  const JointLaw &joint = joints[i];
  const GainsOf<ModelNumbers> &g = joint.gains;
  Memory &m = memory_[i];
  const bool counts = joint.output == JointLaw::Output::stepper && !joint.encoder;
  if (k % 2 == long(i) % 2)
    m.added = g.kf * filtered_.deflection + g.kg * rate_.deflection + joint.ks * filtered_.slope +
              joint.kt * rate_.slope + m.disturbance;
  else
    m.disturbance = m.observer.update(nominal(joint), m.given, m.rate);
  const double place = counts ? m.pulses : m.q, rate = counts ? m.u : m.rate;
  const SignalsOf<ModelNumbers> in{m.reference - place, rate, m.reference_rate,
                                   m.added + evaluate(joint.feedforward, t).y};
  return m.pid.update(a_tick(joint), in);
}

// z^ = z + L (y - C z) (77).
void ControlLaw::estimate() {
  const std::size_t p = std::size_t(linear.states), M = measured_.size();
  estimated_ = predicted_;
  for (std::size_t b = 0; b < M; ++b) {
    const double news = measured_[b] - times_row(linear.C, b, predicted_.data(), p);
    for (std::size_t a = 0; a < p; ++a) estimated_[a] += linear.L[a * M + b] * news;
  }
}

// -K z^ + Kr r + Kv r' + f(t) + what holds the robot where it was linearised, within the limits.
double ControlLaw::linear_output(double t, std::size_t i) {
  const std::size_t N = joints.size();
  double wish =
      linear.hold[i] - times_row(linear.K, i, estimated_.data(), std::size_t(linear.states));
  for (std::size_t j = 0; j < N; ++j)
    wish += linear.Kr[i * N + j] * (memory_[j].reference - linear.offset[j]) +
            linear.Kv[i * N + j] * memory_[j].reference_rate;
  return memory_[i].pid.track(a_tick(joints[i]), wish + evaluate(joints[i].feedforward, t).y);
}

// z = F z^ + G u, with the outputs as given.
void ControlLaw::predict() {
  const std::size_t p = std::size_t(linear.states), N = joints.size();
  for (std::size_t a = 0; a < p; ++a) {
    predicted_[a] = times_row(linear.F, a, estimated_.data(), p);
    for (std::size_t i = 0; i < N; ++i)
      predicted_[a] += linear.G[a * N + i] * (memory_[i].given - linear.hold[i]);
  }
}

// Joint i's output, after its delay, held from t on.
void ControlLaw::give(long k, double t, std::size_t i, SampledOutput &held) {
  const JointLaw &joint = joints[i];
  Memory &m = memory_[i];
  const long size = long(m.ring.size()), late = joint.delay;
  const double T = 1.0 / rate_Hz, last = m.given;
  m.ring[std::size_t(k % size)] = m.u;
  m.given = k >= late ? m.ring[std::size_t((k - late) % size)] : 0.0;
  m.pulses += m.u * T;
  Tick row{m.reference, m.given, {0.0, 0.0, 0.0}, filtered_.deflection};
  if (joint.output == JointLaw::Output::force) {
    m.given = row.output = rounded(m.given, joint.duty);
    held.force[i] = row.held[0] = joint.force_per_u * m.given;
  } else {
    row.held[0] = m.place, row.held[1] = m.given;
    if (joint.rigid) row.held[1] = last, row.held[2] = 0.5 * (m.given - last) * rate_Hz;
    m.place += T * (row.held[1] + row.held[2] * T);
    held.motion[i] = {t, {row.held[0], row.held[1], row.held[2], 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
  }
  log.push_back(row);
}

}  // namespace flexura
