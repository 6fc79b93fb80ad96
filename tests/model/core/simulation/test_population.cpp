// Populations: a robot's digits are its own, whatever threads, packs, order and neighbours; robots
// end alone.
#include "simulation/population.hpp"

#include <stdexcept>

#include "check.hpp"
#include "control/plant.hpp"
#include "dynamics/places/outputs.hpp"
#include "link/assembly.hpp"
#include "robot/input_fault.hpp"
#include "simulation/simulation.hpp"

using namespace flexura;

namespace {

constexpr double FREE = std::numeric_limits<double>::infinity();

// Rows of robots: a carriage on a rail, and a flexible link that turns on it.
struct Many {
  std::vector<std::int64_t> counts;
  std::vector<double> numbers, material, gravity, payload, limits;
  int robots;
  bool pushed = false;  // by a load on the flexible link

  Many(int count, int modes, int elements = 4) : robots(count) {
    check::Random random;
    counts = {1, 0, 0, -1, 0, 0, 0, 0, 0, 0, elements, modes, 1, 0, 0, 0};
    for (int k = 0; k < count; ++k) {
      const double length = random(0.2, 0.4);
      numbers.insert(numbers.end(), {0.1, 0.6, 0.05,  5e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                                     0.1, 0.0, -FREE, FREE, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
      numbers.insert(numbers.end(), {length, 0.0, 0.0,   0.0,  0.0, 1e-4, 0.0, 0.0, 0.0, 1e-3, 0.0,
                                     0.0,    0.0, -FREE, FREE, 0.0, 0.0,  0.0, 0.0, 0.0, 0.0});
      material.insert(material.end(), {0.0, length, random(0.1, 0.3), 0.0, 0.0, random(0.2, 3.0),
                                       0.0, 0.0, 0.0, 0.0});
      gravity.insert(gravity.end(), {0.0, -9.81}),
          payload.insert(payload.end(), {random(0.0, 0.05), 0.0, 0.0, 0.0});
      limits.insert(limits.end(), {-FREE, FREE, -FREE, FREE});
    }
  }
  double &number(int robot, int link, int column) {
    return numbers[std::size_t((robot * 2 + link) * NUMBERS + column)];
  }

  // The robots of these numbers, in this order.
  Many of(const std::vector<int> &which) const {
    Many out = *this;
    out.robots = int(which.size());
    auto take = [&](std::vector<double> &to, const std::vector<double> &from, int width) {
      to.clear();
      for (int k : which)
        to.insert(to.end(), from.begin() + k * width, from.begin() + (k + 1) * width);
    };
    take(out.numbers, numbers, 2 * NUMBERS), take(out.material, material, MATERIAL),
        take(out.gravity, gravity, 2);
    take(out.payload, payload, PAYLOAD), take(out.limits, limits, 4);
    return out;
  }

  Population population(const std::string &method, double rtol) const {
    Population out;
    out.robots = {robots,
                  2,
                  1,
                  0,
                  counts.data(),
                  numbers.data(),
                  material.data(),
                  nullptr,
                  gravity.data(),
                  payload.data()};
    out.limits = limits.data(), out.method = method, out.rtol = rtol;
    Inputs acting(2);
    acting.joints[0].force = {Segment{0.0, {1.0, 0, 0, 0, 0, 0}, 0, 0, 0},
                              Segment{0.1, {-1.0, 0, 0, 0, 0, 0}, 0, 0, 0}};
    acting.joints[1].force = {Segment{0.0, {0, 0, 0, 0, 0, 0}, 0.05, 9.0, 0}};
    if (pushed)
      acting.loads = {{{1, 0.15, true}, {{}, {Segment{0.0, {0.1, 0, 0, 0, 0, 0}, 0, 0, 0}}, {}}}};
    out.drives = {acting}, out.drive_of.assign(std::size_t(robots), 0);
    for (int k = 0; k <= 10; ++k) out.times.push_back(0.02 * k);
    out.channels = {{Channel::position, 0},
                    {Channel::velocity, 1},
                    {Channel::drive, 0},
                    {Channel::account, WORK}};
    for (int column = 0; column < 3 + 3 + 2 + 3 + 5; ++column)
      out.channels.push_back({Channel::seen, column});
    out.stations = 3;
    return out;
  }
};

struct Results {
  std::vector<double> values;
  std::vector<Ending> endings;
  std::size_t channels, robots, times;
  double at(std::size_t channel, int robot, std::size_t row) const {
    return values[(channel * robots + std::size_t(robot)) * times + row];
  }
};

Results results(const Population &population, int threads) {
  Results out{{},
              {},
              population.channels.size(),
              std::size_t(population.robots.count),
              population.times.size()};
  out.values.resize(out.channels * out.robots * out.times);
  const std::atomic<bool> stop{false};
  std::atomic<long> done{0};
  out.endings = run(population, threads, out.values.data(), stop, done);
  CHECK(done == population.robots.count);
  return out;
}

bool same(const Results &a, int i, const Results &b, int j) {
  const Ending &x = a.endings[std::size_t(i)], &y = b.endings[std::size_t(j)];
  bool out = x.status == y.status && x.refusal == y.refusal && x.steps == y.steps &&
             x.reached == y.reached && x.joint == y.joint && x.text == y.text;
  for (std::size_t c = 0; c < a.channels; ++c)
    for (std::size_t row = 0; row < a.times; ++row) {
      const double p = a.at(c, i, row), q = b.at(c, j, row);
      out = out && ((std::isnan(p) && std::isnan(q)) || check::same_bits(p, q));
    }
  return out;
}

}  // namespace

TEST("threads, order and neighbours change no bit") {
  for (const char *method : {"explicit", "implicit", "exponential", "auto"})
    for (int modes : {2, -1}) {
      const Many many(10, modes, modes < 0 ? 2 : 4);
      const Results whole = results(many.population(method, 1e-4), 1),
                    threads = results(many.population(method, 1e-4), 3);
      for (int k = 0; k < 10; ++k)
        CHECK(whole.endings[std::size_t(k)].status == Status::done && same(whole, k, threads, k));
      const std::vector<int> order{7, 2, 9, 0, 5};
      const Results some = results(many.of(order).population(method, 1e-4), 2);
      for (int k = 0; k < 5; ++k) CHECK(same(whole, order[std::size_t(k)], some, k));
    }
}

// A robot of a population is the robot of a single run; `name`: the method that makes it.
void check_single_runs(const Many &many, const char *method, double rtol, const char *name) {
  const Population population = many.population(method, rtol);
  const Results all = results(population, 1);
  for (int k = 0; k < many.robots; ++k) {
    auto model = std::make_shared<const Model<double>>(assemble(robot_of(population.robots, k)));
    Request request;
    request.times = population.times, request.q.assign(std::size_t(model->n), 0.0),
    request.v = request.q;
    request.rtol = population.rtol, request.method = method;
    Simulation single(model, population.drives[0], request);
    while (single.advance(100)) {
    }
    const Record &record = single.record();
    CHECK(single.method() == name);
    Observer<double> observer(*model, 3);
    std::vector<double> row(std::size_t(observer.columns()));
    CHECK(single.run_state().steps == all.endings[std::size_t(k)].steps);
    for (int r = 0; r < record.rows; ++r) {
      const double *z = record.state.data() + r * record.size;
      CHECK(check::same_bits(z[0], all.at(0, k, std::size_t(r))));
      CHECK(check::same_bits(z[model->n + 1], all.at(1, k, std::size_t(r))));
      observer.observe(z, z + model->n, row.data());
      for (std::size_t c = 0; c < row.size(); ++c)
        CHECK(check::same_bits(row[c], all.at(4 + c, k, std::size_t(r))));
    }
  }
}

TEST("a robot of a population is the robot of a single run") {
  for (const char *method : {"explicit", "implicit", "exponential"})
    check_single_runs(Many(3, 2), method, 1e-5, method);
  check_single_runs(Many(3, 2), "auto", 1e-5, "exponential");
}

TEST("a robot of a population under a load is the robot of a single run") {
  Many many(5, 2);
  const Results free = results(many.population("exponential", 1e-5), 1);
  many.pushed = true;
  for (const char *method : {"explicit", "implicit", "exponential"})
    check_single_runs(many, method, 1e-5, method);
  check_single_runs(many, "auto", 1e-5, "exponential");
  const Results whole = results(many.population("exponential", 1e-5), 3);
  CHECK(!same(free, 0, whole, 0));
  CHECK(same(results(many.of({4, 1}).population("exponential", 1e-5), 1), 1, whole, 1));
}

TEST("in a population too, auto takes implicit steps under a strong damper") {
  Many many(3, 2);
  for (int k = 0; k < 3; ++k) many.number(k, 1, 11) = 2.0;  // viscous, on a hub of 1e-4 kg m^2
  check_single_runs(many, "auto", 1e-5, "implicit");
  check_single_runs(many, "auto", 1e-10, "explicit");
}

TEST(
    "robots that are refused, limited or stuck end alone; another kind of equations gets a pack of "
    "its own") {
  const Many good(6, 2);
  Many many = good;
  many.limits[4 * 1] = -1e-4, many.limits[4 * 1 + 1] = 1e-4;  // robot 1 meets a limit
  many.number(2, 0, 1) = many.number(2, 0, 3) = 0.0,
                    many.material[2 * MATERIAL + 2] = many.payload[2 * PAYLOAD] =
                        0.0;                                                 // moves nothing
  many.number(3, 0, 13) = 0.1, many.number(3, 0, 14) = 0.2;                  // starts outside
  many.material[4 * MATERIAL + 6] = -0.1 * many.material[4 * MATERIAL + 5];  // tapered: more shapes
  const Results whole = results(good.population("implicit", 1e-4), 1),
                out = results(many.population("implicit", 1e-4), 2);
  CHECK(same(whole, 0, out, 0) && same(whole, 5, out, 5));
  CHECK(out.endings[1].status == Status::limit && out.endings[1].joint == 0 &&
        out.endings[1].reached < 0.2);
  CHECK_NEAR(std::fabs(out.endings[1].position[0]), 1e-4, 1e-8);
  CHECK(std::isnan(out.at(0, 1, 10)) && check::same_bits(out.at(0, 1, 0), whole.at(0, 1, 0)));
  CHECK(out.endings[2].refusal == Ending::fault && out.endings[2].key == "joint" &&
        std::isnan(out.at(0, 2, 0)));
  CHECK(out.endings[3].refusal == Ending::start && out.endings[3].joint == 0);
  CHECK(out.endings[4].status == Status::done);
  const Results tapered = results(many.of({4}).population("implicit", 1e-4), 1);
  CHECK(same(tapered, 0, out, 4));
}

TEST("a population that is stopped leaves the rest") {
  const Many many(8, 2);
  const Population population = many.population("implicit", 1e-4);
  std::vector<double> values(population.channels.size() * 8 * population.times.size());
  const std::atomic<bool> stop{true};
  std::atomic<long> done{0};
  const auto endings = run(population, 2, values.data(), stop, done);
  CHECK(done == 0 && endings[0].status == Status::running);
}

TEST("robots that are assembled together have the numbers of each alone") {
  for (int modes : {1, 3, -1}) {
    const Many many(4, modes);
    const Population population = many.population("implicit", 1e-4);
    std::vector<Robot> robots;
    const Robot *pointers[4];
    Model<double> models[4];
    std::unique_ptr<Fault> faults[4];
    for (int k = 0; k < 4; ++k) robots.push_back(robot_of(population.robots, k));
    robots[2].links.push_back(
        robots[2].links[1]);  // all have a follower, so that static shapes are among the modes
    for (int k : {0, 1, 3}) robots[std::size_t(k)].links.push_back(robots[2].links[2]);
    for (int k = 0; k < 4; ++k) pointers[k] = &robots[std::size_t(k)];
    assemble(pointers, 4, models, faults);
    for (int k = 0; k < 4; ++k) {
      const Model<double> alone = assemble(robots[std::size_t(k)]);
      CHECK(!faults[k] && alone.numbers == models[k].numbers && alone.n == models[k].n);
    }
  }
}

namespace {

// Robot k of a population, with what acts on it, is that of a population of its own.
void check_alone(const Many &many, const Population &population) {
  const Results all = results(population, 1);
  for (int k = 0; k < many.robots; ++k) {
    const Many only = many.of({k});
    Population one = only.population(population.method, population.rtol);
    one.drives = {population.drives[std::size_t(population.drive_of[std::size_t(k)])]};
    CHECK(same(all, k, results(one, 1), 0));
  }
}

}  // namespace

TEST("robots of other damping, points or methods share no pack") {
  Many many(8, 2);
  many.number(1, 1, 4) = 0.3;   // damping in proportion to mass
  many.number(2, 1, 11) = 2.0;  // "auto" takes implicit steps
  many.material[3 * MATERIAL + 6] = -0.1 * many.material[3 * MATERIAL + 5];
  check_alone(many, many.population("auto", 1e-5));
}

TEST("robots whose joints are driven in other ways share no pack; a motion that is given is kept") {
  const Many many(4, 2);
  Population population = many.population("implicit", 1e-5);
  Inputs given = population.drives[0];
  given.joints[0].motion = {Segment{0.0, {0.0, 0.1, 0.0, 0.0, 0.0, 0.0}, 0.02, 8.0, 0.0}};
  given.joints[0].prescribed = given.joints[1].prescribed = true;  // the second has no motion
  population.drives.push_back(given), population.drive_of = {0, 1, 0, 1};
  check_alone(many, population);
  const Results out = results(population, 1);
  for (std::size_t row = 0; row < out.times; ++row) {
    const double t = population.times[row];
    CHECK_NEAR(out.at(0, 1, row), 0.1 * t + 0.02 * std::sin(8.0 * t), 1e-15);
  }
  CHECK(out.at(1, 1, 10) != 0.0);
}

TEST("robots start where they are told, all alike or each by itself") {
  const Many many(3, 2);
  const Population own = many.population("implicit", 1e-5);
  const std::size_t n = std::size_t(assemble(robot_of(own.robots, 0)).n);
  const Results still = results(own, 1);
  auto started = [&](std::size_t q, std::size_t v, double at) {
    Population out = own;
    out.q.assign(q, 0.0), out.v.assign(v, 0.0);
    if (q > n) out.q[n] = at;
    if (v > 0) out.v[0] = at;
    return results(out, 1);
  };
  for (std::size_t size : {n, 3 * n})
    for (int k = 0; k < 3; ++k) CHECK(same(started(size, n, 0.0), k, still, k));
  const Results moved = started(3 * n, 0, 0.1), struck = started(0, n, 0.1);
  CHECK(moved.at(0, 1, 0) == 0.1 && same(moved, 0, still, 0) && same(moved, 2, still, 2));
  CHECK_NEAR(moved.at(0, 1, 10) - still.at(0, 1, 10), 0.1, 1e-4);  // the rail is level
  CHECK_NEAR(struck.at(0, 1, 1) - still.at(0, 1, 1), 0.1 * own.times[1], 1e-5);
  for (const auto &sizes : {std::pair(n - 1, n), std::pair(2 * n, n), std::pair(n, n + 1)}) {
    bool refused = false;
    try {
      started(sizes.first, sizes.second, 0.0);
    } catch (const std::invalid_argument &) {
      refused = true;
    }
    CHECK(refused);
  }
}

TEST("a population that is stopped in a run ends there, alone and in a pack") {
  Many many(4, 2);
  for (bool alone : {true, false}) {
    many.pushed = alone;
    Population population = many.population(alone ? "explicit" : "auto", 1e-9);
    if (!alone) population.rtol = 1e-5;
    for (double &t : population.times) t *= 1e4;
    std::atomic<bool> stop{false};
    population.drives[0].function = [&](double, const double *, const double *, double *) {
      stop = true;
    };
    std::vector<double> values(population.channels.size() * 4 * population.times.size());
    std::atomic<long> done{0};
    const auto endings = run(population, 1, values.data(), stop, done);
    for (const Ending &ending : endings) {
      CHECK(ending.status == (alone ? Status::running : Status::interrupted));
      CHECK((ending.steps > 0) == alone && ending.reached < population.times[1]);
    }
    CHECK(std::isnan(values[0]) != alone && std::isnan(values[1]));
  }
}

TEST("sharp tolerances of stiff robots, and a slider on a sleeve: each as it runs alone") {
  Many stiff(2, 2);
  for (int k = 0; k < 2; ++k) stiff.material[std::size_t(k) * MATERIAL + 5] = 1e9;
  check_alone(stiff, stiff.population("auto", 1e-10));
  Many riding(5, 2);
  riding.counts = {2, 0, 4, 2, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0};
  for (int k = 0; k < 5; ++k) {
    riding.material[std::size_t(k) * MATERIAL + 1] = riding.number(k, 0, 0) = 0.5;
    riding.number(k, 0, 1) = riding.number(k, 0, 2) = riding.number(k, 0, 3) = 0.0;
    riding.number(k, 0, 7) = 0.4, riding.number(k, 0, 8) = 0.1;  // start, mass of the sleeve
    riding.number(k, 1, 0) = 0.1, riding.number(k, 1, 1) = 0.2, riding.number(k, 1, 2) = 0.05,
                        riding.number(k, 1, 3) = 1e-4, riding.number(k, 1, 7) = 0.3;
  }
  const Population population = riding.population("auto", 1e-4);
  check_alone(riding, population);
  for (const Ending &ending : results(population, 1).endings) CHECK(ending.status == Status::done);
}

TEST("robots that get stuck or diverge in a pack end as they do alone") {
  const Many many(4, 2);
  for (double at : {0.02, 0.15})
    for (double force : {1e200, 1e308})
      for (const char *method : {"implicit", "auto"}) {
        Population population = many.population(method, 1e-5);
        Inputs jumps = population.drives[0];
        if (at < 0.1) jumps.joints[0].force.pop_back();
        jumps.joints[0].force.push_back(Segment{at, {force, 0, 0, 0, 0, 0}, 0, 0, 0});
        population.drives.push_back(jumps), population.drive_of = {0, 1, 0, 1};
        check_alone(many, population);
        const Results out = results(population, 1);
        CHECK(out.endings[0].status == Status::done);
        CHECK(out.endings[1].status == Status::stuck || out.endings[1].status == Status::diverged);
        CHECK(out.endings[1].reached >= at - 1e-9 && out.endings[1].reached < at + 0.05);
      }
}

TEST("a robot that gets stuck at a force without bound leaves its neighbours in a pack alone") {
  const Many many(4, 2);
  Population population = many.population("implicit", 1e-5);
  Inputs steep = population.drives[0];
  steep.function = [](double, const double *q, const double *, double *force) {
    force[0] = 1.0 / std::pow(0.01 - q[0], 3);
  };
  population.drives.push_back(steep), population.drive_of = {0, 1, 0, 1};
  check_alone(many, population);
  const Results out = results(population, 1);
  CHECK(out.endings[0].status == Status::done && out.endings[1].status == Status::stuck);
  CHECK(out.endings[1].position[0] < 0.01);
}
