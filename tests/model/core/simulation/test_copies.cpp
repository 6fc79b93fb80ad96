// Copies of one robot: their digits are their own, whatever threads and neighbours; one that cannot
// go on stays where it was; the error goes with the square of the step.
#include "simulation/copies.hpp"

#include <cmath>
#include <limits>

#include "check.hpp"
#include "link/assembly.hpp"

using namespace flexura;

namespace {

constexpr double FREE = std::numeric_limits<double>::infinity();

// Two equal strips that turn; friction in the first joint [N m].
std::shared_ptr<const Model<double>> arm(double coulomb) {
  Robot robot;
  Link link;
  link.length = 0.3, link.elements = 2, link.beta = 1e-3, link.joint.hub_inertia = 1e-3;
  Interval all;
  all.to = link.length, all.mass[0] = 0.3, all.stiffness[0] = 0.5;
  link.material = {all};
  robot.links = {link, link};
  robot.links[0].joint.coulomb = coulomb;
  return std::make_shared<const Model<double>>(assemble(robot));
}

// Copies that begin bent and moving, each in its own way.
struct Some {
  std::vector<double> q, v, force, deflection, tip;
  std::unique_ptr<bool[]> moves, arrived;
  int count;
  double low[2] = {-FREE, -FREE}, high[2] = {FREE, FREE};

  Some(const Copies &copies, const std::vector<int> &which) : count(int(which.size())) {
    moves.reset(new bool[which.size()]), arrived.reset(new bool[which.size()]);
    for (std::size_t k = 0; k < which.size(); ++k) {
      const int number = which[k];
      for (int i = 0; i < copies.unknowns(); ++i)
        q.push_back(0.03 * std::sin(1.7 * number + i)), v.push_back(0.5 * std::cos(number - i));
      force.push_back(0.1 * std::sin(number + 0.5)), force.push_back(0.02 * std::cos(3.0 * number));
      moves[k] = true, arrived[k] = false;
    }
    deflection.assign(2 * which.size(), 0.0), tip.assign(2 * which.size(), 0.0);
  }
  void go(const Copies &copies, double duration, int steps, int threads = 1) {
    copies.advance({count, q.data(), v.data(), force.data(), low, high, moves.get(),
                    deflection.data(), tip.data(), arrived.get()},
                   duration / steps, steps, threads);
  }
  double distance(const Some &other) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < q.size(); ++i) sum += std::pow(q[i] - other.q[i], 2);
    return std::sqrt(sum);
  }
};

}  // namespace

TEST("a copy's digits are its own") {
  const Copies copies(arm(0.01));
  std::vector<int> all(150);
  for (int k = 0; k < 150; ++k) all[std::size_t(k)] = k;
  Some many(copies, all), threads(copies, all), few(copies, {149, 7, 7, 31, 2});
  many.go(copies, 0.02, 4), threads.go(copies, 0.02, 4, 3), few.go(copies, 0.02, 4);
  for (std::size_t i = 0; i < many.q.size(); ++i)
    CHECK(check::same_bits(many.q[i], threads.q[i]) && check::same_bits(many.v[i], threads.v[i]));
  const std::size_t n = std::size_t(copies.unknowns());
  for (std::size_t i = 0; i < n; ++i) {
    CHECK(check::same_bits(many.q[149 * n + i], few.q[i]));
    CHECK(check::same_bits(many.v[7 * n + i], few.v[2 * n + i]));
    CHECK(check::same_bits(many.q[2 * n + i], few.q[4 * n + i]));
  }
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(check::same_bits(many.deflection[2 * 31 + i], few.deflection[6 + i]));
    CHECK(check::same_bits(many.tip[2 * 31 + i], few.tip[6 + i]));
  }
  for (int k = 0; k < 150; ++k) CHECK(many.arrived[std::size_t(k)]);
}

TEST("one that cannot go on stays where it was") {
  const Copies copies(arm(0.01));
  const Some before(copies, {0, 1, 2, 3, 4});
  Some some(copies, {0, 1, 2, 3, 4});
  const std::size_t n = std::size_t(copies.unknowns());
  some.moves[1] = false;                                       // is not asked to move
  some.high[0] = before.q[2 * n] + 1e-6, some.v[2 * n] = 2.0;  // meets its limit
  some.force[3 * 2] = std::nan("");
  for (std::size_t k : {0u, 3u, 4u}) some.q[k * n] = -0.5;
  some.go(copies, 0.02, 4);
  CHECK(some.arrived[0] && !some.arrived[1] && !some.arrived[2] && !some.arrived[3]);
  CHECK(some.arrived[4]);
  for (std::size_t i = 0; i < n; ++i) {
    CHECK(some.q[n + i] == before.q[n + i] && some.q[2 * n + i] == before.q[2 * n + i]);
    CHECK(some.v[n + i] == before.v[n + i] && some.v[3 * n + i] == before.v[3 * n + i]);
  }
  CHECK(some.q[4 * n] != -0.5);
}

TEST("one that leaves its lower limit stays where it was, too") {
  const Copies copies(arm(0.0));
  Some some(copies, {0, 1});
  const std::size_t n = std::size_t(copies.unknowns());
  some.q[0] = 0.1, some.q[n] = 0.5, some.v[0] = some.v[n] = -2.0, some.low[0] = 0.099;
  const std::vector<double> before(some.q);
  some.go(copies, 0.01, 4);
  CHECK(!some.arrived[0] && some.arrived[1]);
  CHECK(some.q[0] == before[0] && some.q[n] < before[n]);
}

TEST("the error goes with the square of the step") {
  const Copies copies(arm(0.0));
  std::vector<Some> runs;
  for (int steps : {1024, 2048, 4096}) {
    runs.emplace_back(copies, std::vector<int>{1, 2});
    runs.back().go(copies, 0.05, steps);
  }
  const double ratio = runs[0].distance(runs[1]) / runs[1].distance(runs[2]);
  CHECK_NEAR(ratio, 4.0, 0.2);
}
