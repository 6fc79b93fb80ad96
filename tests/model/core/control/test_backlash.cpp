// A joint behind backlash: its force at a state.
#include "check.hpp"
#include "control/inputs.hpp"

using namespace flexura;

namespace {

Signal line(double y, double rate) {
  return {Segment{0.0, {y, rate, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0}};
}

TEST("the force is that of the flank, and none between") {
  const ForceFunction f = backlash_forces({{1, line(0.5, 2.0), 0.2, 100.0, 3.0}}, {0, 2});
  const double v[] = {0.0, 0.0, 7.0};
  const struct {
    double place, force;
  } cases[] = {
      {0.7, 0.0}, {0.61, 0.0}, {0.85, -100.0 * 0.05 - 3.0 * 5.0}, {0.5, 100.0 * 0.1 - 15.0}};
  for (const auto &each : cases) {
    const double q[] = {9.0, 9.0, each.place};
    double force[] = {1.0, 1.0};
    f(0.1, q, v, force);  // the motion is at 0.7
    CHECK(force[0] == 1.0);
    CHECK_NEAR(force[1], 1.0 + each.force, 1e-12);
  }
}

}  // namespace
