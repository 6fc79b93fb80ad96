// Methods by their names, the one for a controller's ticks, and the end of a run in a sentence.
#include "simulation/method_by_name.hpp"

#include <string>

#include "check.hpp"
#include "control/inputs.hpp"
#include "plants.hpp"

using namespace flexura;

namespace {

std::string name_of(const char *name) {
  Masses<double> plant(1);
  Inputs acting(1);
  Inputs *all[1] = {&acting};
  Integration<double> run(plant, all, 1e-6);
  const auto method = make_method<double>(name, run);
  return method ? method->name() : "none";
}
std::string name_of_four(const char *name) {
  Masses<Pack<4>> plant(1);
  Inputs acting(1);
  Inputs *all[4] = {&acting, &acting, &acting, &acting};
  Integration<Pack<4>> run(plant, all, 1e-6);
  const auto method = make_method<Pack<4>>(name, run);
  return method ? method->name() : "none";
}
bool says(const RunState &c, const char *words) {
  return explain(c, "implicit", 1e-6).find(words) != std::string::npos;
}

}  // namespace

TEST("each method has its name; no other has one; robots in a pack have no short ticks") {
  for (const char *name : {"explicit", "implicit", "exponential", "implicit-2"})
    CHECK(name_of(name) == name && name_of_four(name) == name);
  for (const char *name : {"explicit-3", "explicit-5"})
    CHECK(name_of(name) == name && name_of_four(name) == "none");
  CHECK(name_of("auto") == "none" && name_of_four("") == "none");
}

TEST("the method for ticks: by the tolerance, and by how far a robot turns in a tick") {
  auto is = [](double fastest, double rtol, const char *name) {
    return std::string(method_for_ticks(1000.0, fastest, rtol)) == name;
  };
  CHECK(is(1e6, 1e-10, "explicit"));
  CHECK(is(1e6, 1e-3, "implicit-2") && is(1e6, 1e-5, "implicit"));
  CHECK(is(100.0, 1e-5, "explicit-3") && is(100.0, 1e-7, "explicit-5"));
  CHECK(is(0.0, 1e-5, "explicit-3") && is(10.5e3, 1e-5, "explicit-3"));
}

TEST("the end of a run in a sentence") {
  RunState c;
  c.t = 0.25;
  CHECK(says(c, "the run goes on at t = 0.25 s"));
  c.status = Status::done;
  CHECK(says(c, "the run is complete"));
  c.status = Status::interrupted;
  CHECK(says(c, "interrupted at t = 0.25 s"));
  c.status = Status::exhausted, c.steps = 30, c.rejected = 12;
  CHECK(says(c, "the budget of 42 steps is used up at t = 0.25 s"));
  c.status = Status::limit, c.joint = 1;
  CHECK(explain(c, "implicit", 1e-6) == "joint 2 meets its limit at t = 0.25 s");
  c.status = Status::diverged;
  CHECK(says(c, "beyond t = 0.25 s; first in the position of joint 2"));
  c.rate = true;
  CHECK(says(c, "the speed of joint 2"));
  c.elastic = true, c.status = Status::stuck, c.step = 1e-17;
  CHECK(says(c, "the rate of bending of link 2 changes faster"));
  c.rate = false;
  CHECK(says(c, "there the bending of link 2"));
  c.joint = -1;
  CHECK(says(c, "there the robot changes faster than steps of 1e-17 s"));
}
