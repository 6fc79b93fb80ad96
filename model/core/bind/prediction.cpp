// The motion ahead of a predictive controller.
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "control/predicted_motion.hpp"
#include "mechanics.hpp"

namespace flexura {
namespace {

using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

void expect(bool good, const char *text) {
  if (!good) throw std::invalid_argument(text);
}

// Of T intervals from x (T, n) under u (T, inputs) with accelerations nearly a (T, m), of h (T)
// seconds: R (T, n, n), G (T, n, inputs), d (T, n), accelerations (T, m).
nb::tuple steps_of(PredictedMotion &self, const Matrix &x, const Matrix &u, const Matrix &a,
                   const Vector &h) {
  const std::size_t T = h.shape(0), n = std::size_t(self.states()), m = n / 2,
                    p = std::size_t(self.inputs());
  expect(x.shape(0) == T && x.shape(1) == n && u.shape(0) == T && u.shape(1) == p &&
             a.shape(0) == T && a.shape(1) == m,
         "x, u and a need a row an interval");
  Array R = new_array({T, n, n}), G = new_array({T, n, p}), d = new_array({T, n}),
        rates = new_array({T, m});
  std::copy_n(a.data(), T * m, rates.data());
  for (std::size_t k = 0; k < T; ++k)
    self.step(x.data() + k * n, u.data() + k * p, rates.data() + k * m, h.data()[k],
              R.data() + k * n * n, G.data() + k * n * p, d.data() + k * n);
  return nb::make_tuple(R, G, d, rates);
}

Array array_of(const std::vector<double> &values, std::initializer_list<std::size_t> shape) {
  Array out = new_array(shape);
  std::copy(values.begin(), values.end(), out.data());
  return out;
}

// H (V, V), g (V), A (N rows, V), at (N rows), by_force (N, n, V), moved (N, n).
nb::tuple condensed_of(const Cube &R, const Cube &G, const Matrix &d, const Matrix &x,
                       const Matrix &u, const Vector &start, const Matrix &wanted, const Cube &W,
                       const Matrix &end, const Matrix &limited) {
  const std::size_t N = R.shape(0), n = R.shape(1), p = G.shape(2), V = N * p,
                    rows = limited.shape(0);
  expect(R.shape(2) == n && G.shape(0) == N && G.shape(1) == n && d.shape(0) == N &&
             d.shape(1) == n && x.shape(0) == N + 1 && x.shape(1) == n && u.shape(0) == N &&
             u.shape(1) == p && start.shape(0) == n && wanted.shape(0) == N &&
             wanted.shape(1) == n && W.shape(0) == N && W.shape(2) == n && end.shape(0) == n &&
             end.shape(1) == n && limited.shape(1) == n,
         "matrices of a program with N intervals were expected");
  TickProgram program;
  program.N = int(N), program.n = int(n), program.inputs = int(p);
  program.outputs = int(W.shape(1)), program.rows = int(rows);
  program.R = R.data(), program.G = G.data(), program.d = d.data(), program.x = x.data();
  program.u = u.data(), program.start = start.data(), program.wanted = wanted.data();
  program.W = W.data(), program.end = end.data(), program.limited = limited.data();
  const CondensedProgram found = condense(program);
  return nb::make_tuple(array_of(found.H, {V, V}), array_of(found.g, {V}),
                        array_of(found.A, {N * rows, V}), array_of(found.at, {N * rows}),
                        array_of(found.by_force, {N, n, V}), array_of(found.moved, {N, n}));
}

}  // namespace

void bind_prediction(nb::module_ &module) {
  using namespace nb::literals;
  nb::class_<PredictedMotion>(module, "PredictedMotion", "The motion ahead of a controller.")
      .def(
          "__init__",
          [](PredictedMotion *self, const Mechanics &robot, std::vector<int> free,
             std::vector<int> driven) {
            new (self) PredictedMotion(robot.model, std::move(free), std::move(driven));
          },
          "robot"_a, "free"_a, "driven"_a)
      .def("steps", &steps_of, "x"_a, "u"_a, "a"_a, "h"_a,
           "R, G, d of x+ = R x + G u + d in each interval, and the accelerations.");
  module.def("condensed_program", &condensed_of, "R"_a, "G"_a, "d"_a, "x"_a, "u"_a, "start"_a,
             "wanted"_a, "W"_a, "end"_a, "limited"_a,
             "H, g, A, at, by_force, moved of a tick's program.");
}

}  // namespace flexura
