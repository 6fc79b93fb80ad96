#include "fmi/co_simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "link/assembly.hpp"
#include "simulation/method_by_name.hpp"
#include "statics_and_modes/equilibrium.hpp"

namespace flexura {
namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", x);
  return text;
}

std::string joint(std::size_t link) { return "joint " + std::to_string(link + 1); }

// Which link a reference of the kind that begins at `first` is of, or `links`.
std::size_t link_of(unsigned reference, unsigned first, std::size_t links) {
  return reference >= first && reference - first < links ? reference - first : links;
}

}  // namespace

CoSimulation::CoSimulation(const RobotFile &file)
    : model_(std::make_shared<const Model<double>>(assemble(file.robot))),
      limits_(file.limits),
      sensors_(file.sensors),
      in_equilibrium_(file.in_equilibrium),
      observer_(*model_, file.stations),
      work_(*model_),
      at_(unsigned(model_->links()), unsigned(observer_.columns()), unsigned(file.sensors.size())),
      rtol_(file.rtol),
      stop_(std::numeric_limits<double>::infinity()) {
  const std::size_t n = std::size_t(model_->n), links = std::size_t(model_->links());
  if (model_->n != file.unknowns)
    throw std::runtime_error("the robot has " + std::to_string(n) + " unknowns; its file counts " +
                             std::to_string(file.unknowns));
  now_.q.assign(n, 0.0), now_.v.assign(n, 0.0), now_.accounts.assign(ACCOUNTS, 0.0);
  now_.force.assign(links, 0.0), begun_ = now_.accounts;
  seen_.assign(std::size_t(observer_.columns()), 0.0);
  inputs_.assign(links, Segment{0.0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0});
  for (std::size_t i = 0; i < links; ++i) now_.q[std::size_t(model_->first[i])] = model_->start[i];
}

double CoSimulation::get(unsigned reference) {
  const std::size_t links = std::size_t(model_->links());
  if (reference == 0) return now_.t;
  if (reference == at_.tolerance) return rtol_;
  if (reference >= at_.end)
    throw std::invalid_argument("there is no variable " + std::to_string(reference));
  const std::size_t of_force = link_of(reference, at_.drive, links);
  if (of_force < links) return now_.force[of_force];
  place();
  for (const unsigned first : {at_.position, at_.motor_position}) {
    const std::size_t i = link_of(reference, first, links);
    if (i == links) continue;
    return first == at_.position ? hub_position(*model_, int(i), now_.q.data())
                                 : now_.q[std::size_t(model_->first[i])];
  }
  for (const unsigned first : {at_.velocity, at_.motor_velocity}) {
    const std::size_t i = link_of(reference, first, links);
    if (i == links) continue;
    return first == at_.velocity ? hub_position(*model_, int(i), now_.v.data())
                                 : now_.v[std::size_t(model_->first[i])];
  }
  if (reference >= at_.sensors) return sensed(sensors_[reference - at_.sensors]);
  if (reference >= at_.accounts) return now_.accounts[reference - at_.accounts];
  observe();
  return seen_[reference - at_.seen];
}

void CoSimulation::set(unsigned reference, double value) {
  const std::size_t links = std::size_t(model_->links());
  if (!std::isfinite(value))
    throw std::invalid_argument("variable " + std::to_string(reference) +
                                ": expected a finite number");
  const std::size_t of_force = link_of(reference, at_.drive, links);
  if (of_force < links) {
    now_.force[of_force] = value;
    return;
  }
  if (reference == at_.tolerance && !now_.started) {
    if (!(1e-13 <= value && value <= 0.1))
      throw std::invalid_argument("rtol is " + number(value) +
                                  ": expected a relative tolerance between 1e-13 and 0.1");
    rtol_ = value, rtol_given_ = true;
    return;
  }
  for (const bool rate : {false, true})
    for (const unsigned first : rate ? std::vector<unsigned>{at_.velocity, at_.motor_velocity}
                                     : std::vector<unsigned>{at_.position, at_.motor_position}) {
      const std::size_t i = link_of(reference, first, links);
      if (i < links) return set_start(i, value, rate);
    }
  throw std::invalid_argument("variable " + std::to_string(reference) +
                              " is no input, no start value and no parameter");
}

void CoSimulation::set_start(std::size_t link, double value, bool rate) {
  if (now_.started)
    throw std::invalid_argument(joint(link) + ": its start is set before the simulation only");
  const std::size_t row = std::size_t(model_->first[link]);
  (rate ? now_.v : now_.q)[row] = rate && model_->locked[link] ? 0.0 : value;
  placed_ = false;
}

void CoSimulation::set_derivative(unsigned reference, int order, double value) {
  const std::size_t link = link_of(reference, at_.drive, std::size_t(model_->links()));
  if (link == std::size_t(model_->links()))
    throw std::invalid_argument("variable " + std::to_string(reference) + " is no input");
  if (order < 1 || order > ORDERS || !std::isfinite(value))
    throw std::invalid_argument("expected finite derivatives of the orders 1 to 5");
  double factorial = 1.0;
  for (int k = 2; k <= order; ++k) factorial *= k;
  inputs_[link].c[order] = value / factorial;
}

void CoSimulation::set_tolerance(double rtol) {
  if (!rtol_given_ && std::isfinite(rtol))
    rtol_ = std::fmin(std::fmax(rtol, 1e-13), 0.1);  // a wish of the environment's
}

void CoSimulation::schedule(double t, double stop) {
  if (!std::isfinite(t) || !(stop >= t))
    throw std::invalid_argument("expected a start time before the stop time");
  now_.t = t, stop_ = stop;
}

// Puts links and joints where they start, from the joints' positions: q, v of now_.
void CoSimulation::place() {
  if (placed_ || now_.started) return;
  for (std::size_t i = 0; i < model_->first.size(); ++i) {
    const double q = now_.q[std::size_t(model_->first[i])];
    if (!(limits_[2 * i] <= q && q <= limits_[2 * i + 1]))
      throw std::invalid_argument(joint(i) + " starts at " + number(q) +
                                  ": expected a position inside its limits, " +
                                  number(limits_[2 * i]) + " to " + number(limits_[2 * i + 1]));
    for (int k = 0; k < model_->elastic[i]; ++k)
      now_.q[std::size_t(model_->first[i] + 1 + k)] = 0.0;
  }
  observed_ = false;
  if (in_equilibrium_) {
    const Equilibrium found = equilibrium(*model_, now_.q.data());
    if (found.balance != Balance::stable)
      throw std::runtime_error("there is no stable static equilibrium to start in: found up to " +
                               number(found.share) + " of the weight");
  }
  placed_ = true;
}

void CoSimulation::start() { place(), now_.started = true; }

void CoSimulation::begin_run(double h) {
  Inputs acting(model_->links());
  for (int i = 0; i < model_->links(); ++i)
    acting.limit(i, limits_[2 * std::size_t(i)], limits_[2 * std::size_t(i) + 1]);
  acting.rate_Hz = 1.0 / h;
  Request request;
  request.times = {now_.t}, request.q = now_.q, request.v = now_.v, request.rtol = rtol_;
  request.first_step = FIRST_STEP * h, request.most_steps = MOST_STEPS;
  begun_ = now_.accounts;
  run_ = std::make_unique<Simulation>(model_, std::move(acting), request);
}

bool CoSimulation::step(double t, double h) {
  if (!now_.started) throw std::logic_error("the simulation has not been initialised");
  if (ended_) throw std::logic_error("the simulation has ended: " + message_);
  if (!(h > 0.0) || !std::isfinite(t + h))
    throw std::invalid_argument("expected a finite communication step above 0");
  if (!(std::fabs(t - now_.t) <= 1e-6 * h + 1e-12 * std::fabs(t)))
    throw std::invalid_argument("the communication point is " + number(t) + " s; the robot is at " +
                                number(now_.t) + " s");
  bool jumped = !run_;
  if (!run_) begin_run(h);
  Inputs &acting = run_->acting();
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Segment &next = inputs_[i];
    Signal &force = acting.joints[i].force;
    next.t0 = now_.t, next.c[0] = now_.force[i];
    jumped = jumped || force.empty() || force[0].c[0] != next.c[0];
    for (int k = 1; k <= ORDERS; ++k) jumped = jumped || next.c[k] != 0.0 || force[0].c[k] != 0.0;
    force.assign(1, next);
    for (int k = 1; k <= ORDERS; ++k) next.c[k] = 0.0;
  }
  const double end = t + h;
  run_->go_on(end, std::isfinite(stop_) ? stop_ : end + 1000.0 * h, jumped);
  while (run_->advance(1000)) {
  }
  const RunState &reached = run_->run_state();
  const std::vector<double> z = run_->state();
  const std::size_t n = now_.q.size();
  std::copy_n(z.begin(), n, now_.q.begin()), std::copy_n(z.begin() + long(n), n, now_.v.begin());
  for (std::size_t k = 0; k < now_.accounts.size(); ++k)
    now_.accounts[k] = begun_[k] + z[2 * n + k];
  now_.t = reached.t, observed_ = false;
  if (reached.status == Status::done) return true;
  ended_ = true;
  message_ = explain(reached, run_->method(), rtol_);
  if (reached.status == Status::limit) return false;
  throw std::runtime_error(message_);
}

void CoSimulation::observe() {
  if (!observed_) observer_.observe(now_.q.data(), now_.v.data(), seen_.data());
  observed_ = true;
}

double CoSimulation::sensed(const LinkSensor &sensor) {
  if (sensor.weighted) {
    double sum = 0.0;
    for (std::size_t k = 0; k < now_.q.size(); ++k) sum += sensor.weights[k] * now_.q[k];
    return sum;
  }
  Pose<double> ends[2];
  const double s[2] = {0.0, sensor.at};
  outward_kinematics(*model_, work_, now_.q.data(), now_.v.data());
  line_points(*model_, work_, now_.q.data(), sensor.link, s, 2, ends);
  double sine, cosine;
  sincos(ends[0].angle, sine, cosine);
  return cosine * (ends[1].y - ends[0].y) - sine * (ends[1].x - ends[0].x);
}

CoSimulation::State CoSimulation::state() const { return now_; }

void CoSimulation::restore(const State &state) {
  now_ = state;
  placed_ = state.started, observed_ = ended_ = false;
  run_.reset();
}

}  // namespace flexura
