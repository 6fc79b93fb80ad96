// One robot's run: methods by name, a first step and a budget that are given, a run that goes on.
#include "simulation/simulation.hpp"

#include <stdexcept>

#include "check.hpp"
#include "link/assembly.hpp"
#include "simulation/gain_sweep.hpp"

using namespace flexura;

namespace {

std::shared_ptr<const Model<double>> pendulum(int elements) {
  Robot robot;
  Link link;
  link.length = 0.5, link.elements = elements, link.mass = 0.2, link.centre = 0.25,
  link.inertia = 1e-3;
  Interval all;
  all.to = 0.5, all.mass[0] = 0.4, all.stiffness[0] = 1.0;
  link.material = {all};
  robot.gravity[1] = -9.81, robot.links = {link};
  return std::make_shared<const Model<double>>(assemble(robot));
}
Request request(const Model<double> &model, const char *method) {
  Request out;
  out.times = {0.0, 0.05, 0.1}, out.q.assign(std::size_t(model.n), 0.0), out.v = out.q;
  out.method = method;
  return out;
}
Status finished(Simulation &run) {
  while (run.advance(10)) {
  }
  return run.run_state().status;
}

}  // namespace

TEST("every method by its name, and no other") {
  const auto model = pendulum(2);
  for (const char *name : {"explicit", "implicit", "exponential", "auto"}) {
    Simulation run(model, Inputs(1), request(*model, name));
    CHECK(finished(run) == Status::done && run.record().rows == 3);
    CHECK((run.method() == name) == (std::string(name) != "auto"));
  }
  bool refused = false;
  try {
    const Simulation run(model, Inputs(1), request(*model, "euler"));
  } catch (const std::invalid_argument &) {
    refused = true;
  }
  CHECK(refused);
}

TEST("a first step that is given is the first one, and changes the motion by the tolerance only") {
  const auto model = pendulum(2);
  Request with = request(*model, "explicit");
  with.first_step = 1e-7;
  Simulation own(model, Inputs(1), request(*model, "explicit")), given(model, Inputs(1), with);
  given.advance(1);
  CHECK(given.run_state().t == 1e-7);
  CHECK(finished(own) == Status::done && finished(given) == Status::done);
  for (std::size_t k = 0; k < std::size_t(model->n); ++k)
    CHECK_NEAR(own.state()[k], given.state()[k], 1e-5);
}

TEST("a run that goes on is the run to the later end; its budget is counted from there") {
  for (const char *name : {"explicit", "auto"}) {
    const auto model = pendulum(2);
    Request to_here = request(*model, name), whole = to_here;
    whole.times = {0.0, 0.05, 0.1, 0.2};
    to_here.most_steps = 100000;
    Simulation run(model, Inputs(1), to_here), once(model, Inputs(1), whole);
    CHECK(finished(run) == Status::done && finished(once) == Status::done);
    run.go_on(0.2, 0.5, false);
    CHECK(finished(run) == Status::done && run.run_state().t == 0.2);
    for (std::size_t k = 0; k < std::size_t(model->n); ++k)
      CHECK_NEAR(run.state()[k], once.state()[k], 1e-4);
    Request short_of = to_here;
    short_of.most_steps = 3;
    Simulation few(model, Inputs(1), short_of);
    CHECK(finished(few) == Status::exhausted);
    few.go_on(0.2, 0.2, true);
    CHECK(finished(few) == Status::exhausted);
    Simulation free(model, Inputs(1), request(*model, name));
    CHECK(finished(free) == Status::done);
    free.go_on(0.2, 0.2, true);
    CHECK(finished(free) == Status::done && free.run_state().t == 0.2);
    CHECK(few.run_state().steps + few.run_state().rejected == 6);
  }
}
