// Populations: many robots of one topology from rows of numbers to rows of channels; copies of one
// robot that step together.
#include "simulation/population.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "packed.hpp"
#include "simulation/copies.hpp"
#include "simulation/method_by_name.hpp"

namespace flexura {
namespace {

using Counts = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// What another thread sees of a population that runs: it can stop it, and ask how many robots are
// done.
struct Watch {
  std::atomic<bool> stop{false};
  std::atomic<long> done{0};
};

// What acts: packed once for all robots that share it.
struct PackedDrive {
  Inputs acting;
  PackedDrive(const Matrix &segments, const Ranges &ranges, const Matrix &gains,
              const Flags &prescribed, const Flags &sampled, const Matrix &limits,
              const nb::object &loads)
      : acting(acting_of(segments, ranges, gains, prescribed, sampled, limits)) {
    add_loads(acting, loads);
  }
};

Channel::Of kind_of(const std::string &name) {
  const char *names[] = {"position", "velocity",       "drive",         "account",
                         "seen",     "motor_position", "motor_velocity"};
  for (int k = 0; k < 7; ++k)
    if (name == names[k]) return Channel::Of(k);
  throw std::invalid_argument("there is no channel " + name);
}

nb::tuple run_population(const Counts &counts, const Cube &numbers, const Cube &material,
                         const Cube &lumps, const Matrix &gravity, const Matrix &payload,
                         const Cube &limits, const std::vector<PackedDrive *> &drives,
                         const Indices &drive_of, const Vector &t, const Vector &q, const Vector &v,
                         double rtol, const std::string &method, bool numerical_damping,
                         long most_steps, const std::vector<std::pair<std::string, int>> &channels,
                         int stations, int threads, Watch &watch) {
  const std::size_t robots = numbers.shape(0), links = counts.shape(0);
  expect(counts.shape(1) == COUNTS && numbers.shape(1) == links && numbers.shape(2) == NUMBERS &&
             material.shape(0) == robots && material.shape(2) == MATERIAL &&
             gravity.shape(0) == robots && lumps.shape(0) == robots && lumps.shape(2) == LUMP &&
             gravity.shape(1) == 2 && payload.shape(0) == robots && payload.shape(1) == PAYLOAD &&
             limits.shape(0) == robots && limits.shape(1) == links && limits.shape(2) == 2 &&
             drive_of.shape(0) == robots && t.shape(0) >= 1,
         "rows of another shape were expected");
  Population population;
  Table &table = population.robots;
  table.count = int(robots), table.links = int(links), table.intervals = int(material.shape(1)),
  table.counts = counts.data();
  table.numbers = numbers.data(), table.material = material.data(), table.gravity = gravity.data(),
  table.payload = payload.data(), table.lumps = int(lumps.shape(1)), table.lump = lumps.data();
  population.limits = limits.data();
  for (const PackedDrive *drive : drives) {
    expect(drive->acting.joints.size() == links, "drives need an entry a joint");
    population.drives.push_back(drive->acting);
  }
  for (std::size_t k = 0; k < robots; ++k) {
    expect(drive_of.data()[k] >= 0 && std::size_t(drive_of.data()[k]) < drives.size(),
           "there is no such drive");
    population.drive_of.push_back(int(drive_of.data()[k]));
  }
  population.times.assign(t.data(), t.data() + t.shape(0));
  population.q.assign(q.data(), q.data() + q.shape(0)),
      population.v.assign(v.data(), v.data() + v.shape(0));
  population.rtol = rtol, population.method = method,
  population.numerical_damping = numerical_damping, population.most_steps = most_steps,
  population.stations = stations;
  for (const auto &[name, index] : channels) population.channels.push_back({kind_of(name), index});
  Array values = new_array({channels.size(), robots, t.shape(0)});
  std::vector<Ending> endings;
  {
    nb::gil_scoped_release release;
    endings = run(population, threads, values.data(), watch.stop, watch.done);
  }
  const std::size_t count = endings.size();
  Array reached = new_array({count}), balance = new_array({count}), steps = new_array({count}),
        joint = new_array({count}), position = new_array({count, links});
  nb::list words;
  nb::dict texts;
  for (std::size_t k = 0; k < count; ++k) {
    const Ending &end = endings[k];
    words.append(end.refusal == Ending::none ? word(end.status) : "refused");
    reached.data()[k] = end.reached, steps.data()[k] = double(end.steps),
    joint.data()[k] = end.joint, balance.data()[k] = end.balance;
    std::copy(end.position.begin(), end.position.end(), position.data() + k * links);
    if (end.refusal == Ending::fault)
      texts[nb::int_(k)] = nb::make_tuple(end.joint, end.key, end.text);
    else if (end.status != Status::done && end.refusal == Ending::none)
      texts[nb::int_(k)] = nb::make_tuple(-1, "", end.text);
  }
  return nb::make_tuple(values, words, reached, steps, joint, position, texts, balance);
}

using Rows = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Marks = nb::ndarray<bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void advance(const Copies &copies, const Rows &q, const Rows &v, const Matrix &force,
             const Matrix &limits, const Marks &moves, const Rows &deflection, const Rows &tip,
             const Marks &arrived, double step_s, int steps, int threads) {
  const std::size_t count = q.shape(0), n = std::size_t(copies.unknowns()),
                    joints = std::size_t(copies.joints()), bending = copies.bending().size();
  const auto shaped = [](const auto &array, std::size_t rows, std::size_t columns) {
    return array.shape(0) == rows && array.shape(1) == columns;
  };
  expect(shaped(q, count, n) && shaped(v, count, n) && shaped(force, count, joints) &&
             shaped(limits, 2, joints) && shaped(deflection, count, bending) &&
             shaped(tip, count, 2) && moves.shape(0) == count && arrived.shape(0) == count &&
             steps > 0 && threads > 0,
         "rows of another shape were expected");
  const Copies::States states{int(count),    q.data(),          v.data(),
                              force.data(),  limits.data(),     limits.data() + joints,
                              moves.data(),  deflection.data(), tip.data(),
                              arrived.data()};
  nb::gil_scoped_release release;
  copies.advance(states, step_s, steps, threads);
}

}  // namespace

void bind_population(nb::module_ &module) {
  using namespace nb::literals;
  nb::class_<Watch>(module, "Watch", "What another thread sees of a population that runs.")
      .def(nb::init<>())
      .def(
          "stop", [](Watch &self) { self.stop = true; }, "Ends every robot where it is.")
      .def_prop_ro("stopped", [](const Watch &self) { return self.stop.load(); })
      .def_prop_ro(
          "done", [](const Watch &self) { return self.done.load(); }, "How many robots are done.");
  nb::class_<PackedDrive>(module, "Drive", "What acts on robots that share it.")
      .def(nb::init<const Matrix &, const Ranges &, const Matrix &, const Flags &, const Flags &,
                    const Matrix &, const nb::object &>(),
           "segments"_a, "ranges"_a, "gains"_a, "prescribed"_a, "sampled"_a, "limits"_a,
           "loads"_a = nb::none());
  module.def("population", &run_population, "counts"_a, "numbers"_a, "material"_a, "lumps"_a,
             "gravity"_a, "payload"_a, "limits"_a, "drives"_a, "drive_of"_a, "t"_a, "q"_a, "v"_a,
             "rtol"_a, "method"_a, "numerical_damping"_a, "most_steps"_a, "channels"_a,
             "stations"_a, "threads"_a, "watch"_a,
             "Values (channels, robots, times); of each robot how it ended, the time reached, "
             "steps, joint, "
             "positions of the joints; texts by robot; balances of the energies.");
  nb::class_<Copies>(module, "Copies", "Copies of one robot that step together.")
      .def(
          "__init__", [](Copies *self, const Mechanics &robot) { new (self) Copies(robot.model); },
          "robot"_a)
      .def("advance", &advance, "q"_a.noconvert(), "v"_a.noconvert(), "force"_a, "limits"_a,
           "moves"_a.noconvert(), "deflection"_a.noconvert(), "tip"_a.noconvert(),
           "arrived"_a.noconvert(), "step_s"_a, "steps"_a, "threads"_a,
           "Moves the copies that are marked by equal steps under forces that are held, in place: "
           "their states (B, n), deflections of the links that bend and x, y of the tip; marks "
           "those that arrived within the limits (2, links).");
}

}  // namespace flexura
