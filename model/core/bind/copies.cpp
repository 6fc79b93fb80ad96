// Copies of one robot that step together: `Copies`.
#include "simulation/copies.hpp"

#include "mechanics.hpp"

namespace flexura {
namespace {

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

void bind_copies(nb::module_ &module) {
  using namespace nb::literals;
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
