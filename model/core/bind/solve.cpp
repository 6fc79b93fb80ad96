// Statics and small motions of a robot's equations, and the motion ahead of a predictive
// controller.
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "control/predicted_motion.hpp"
#include "mechanics.hpp"
#include "statics_and_modes/equilibrium.hpp"
#include "statics_and_modes/force_derivatives.hpp"
#include "statics_and_modes/natural_modes.hpp"

namespace flexura {
namespace {

using Flags = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void check_state(const Mechanics &self, const Vector &q) {
  expect(q.shape(0) == std::size_t(self.model->n), "q needs an entry an unknown");
}

TipLoad load_of(const Vector &load) {
  expect(load.shape(0) == 3, "a load is two forces and a moment");
  TipLoad out;
  out.force[0] = load.data()[0], out.force[1] = load.data()[1], out.moment = load.data()[2];
  return out;
}

std::vector<char> free_joints(const Mechanics &self, const Flags &free) {
  expect(free.shape(0) == self.model->first.size(), "a flag a joint was expected");
  std::vector<char> out(free.data(), free.data() + free.shape(0));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = out[i] && !self.model->locked[i];
  return out;
}

nb::tuple equilibrium_of(const Mechanics &self, const Vector &q, const Vector &load,
                         const Flags &free) {
  check_state(self, q);
  Array out = new_array({q.shape(0)});
  std::copy(q.data(), q.data() + q.shape(0), out.data());
  const std::vector<char> turning = free_joints(self, free);
  const TipLoad held = load_of(load);
  Equilibrium found;
  {
    nb::gil_scoped_release release;
    found = equilibrium(*self.model, out.data(), held, turning.data());
  }
  return nb::make_tuple(out, int(found.balance), found.share, found.sweeps);
}

nb::tuple modes_of(const Mechanics &self, const Vector &q, const Flags &free, int most,
                   const Vector &load, bool shapes) {
  check_state(self, q);
  const std::vector<char> moving = free_joints(self, free);
  const TipLoad held = load_of(load);
  NaturalModes found;
  {
    nb::gil_scoped_release release;
    found = natural_modes(*self.model, q.data(), moving.data(), most, held, shapes);
  }
  Array squares = new_array({std::size_t(found.count)}),
        out = new_array({shapes ? q.shape(0) : 0, std::size_t(found.count)});
  std::copy(found.squares.begin(), found.squares.end(), squares.data());
  std::copy(found.shapes.begin(), found.shapes.end(), out.data());
  return nb::make_tuple(squares, out);
}

Array mass_of(const Mechanics &self, const Vector &q) {
  check_state(self, q);
  Array out = new_array({q.shape(0), q.shape(0)});
  mass_matrix(*self.model, q.data(), out.data());
  return out;
}

Array stiffness_of(const Mechanics &self, const Vector &q, const Vector &v) {
  check_state(self, q);
  if (v.shape(0) != 0) check_state(self, v);
  Array out = new_array({q.shape(0), q.shape(0)});
  stiffness_matrix(*self.model, q.data(), v.shape(0) ? v.data() : nullptr, TipLoad{}, out.data());
  return out;
}

Array rates_of(const Mechanics &self, const Vector &q, const Vector &v) {
  check_state(self, q), check_state(self, v);
  Array out = new_array({q.shape(0), q.shape(0)});
  rate_matrix(*self.model, q.data(), v.data(), out.data());
  return out;
}

// Of T states, rows of q, v, a (T, n): the forces, their derivatives by q, v and a, the tip's
// places and their derivatives by q.
nb::tuple force_derivatives_of(const Mechanics &self, const Matrix &q, const Matrix &v,
                               const Matrix &a) {
  const std::size_t n = std::size_t(self.model->n), count = q.shape(0), square = n * n;
  for (const Matrix *x : {&q, &v, &a})
    expect(x->shape(1) == n && x->shape(0) == count,
           "q, v and a need a row a state and a column an unknown");
  Array force = new_array({count, n}), by_position = new_array({count, n, n}),
        by_rate = new_array({count, n, n}), by_acceleration = new_array({count, n, n}),
        tip = new_array({count, 2}), tip_by_position = new_array({count, 2, n});
  {
    nb::gil_scoped_release release;
    ForceDerivatives derivatives(*self.model);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t row = k * n;
      derivatives.at(q.data() + row, v.data() + row, a.data() + row, force.data() + row,
                     by_position.data() + k * square, by_rate.data() + k * square,
                     tip.data() + 2 * k, tip_by_position.data() + 2 * row);
      mass_matrix(*self.model, q.data() + row, by_acceleration.data() + k * square);
    }
  }
  return nb::make_tuple(force, by_position, by_rate, by_acceleration, tip, tip_by_position);
}

using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

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

TickProgram program_of(const Cube &R, const Cube &G, const Matrix &d, const Cube &W,
                       const Matrix &end, const Matrix &limited) {
  const std::size_t N = R.shape(0), n = R.shape(1), p = G.shape(2);
  expect(R.shape(2) == n && G.shape(0) == N && G.shape(1) == n && d.shape(0) == N &&
             d.shape(1) == n && W.shape(0) == N && W.shape(2) == n && end.shape(0) == n &&
             end.shape(1) == n && limited.shape(1) == n,
         "matrices of a program with N intervals were expected");
  TickProgram program;
  program.N = int(N), program.n = int(n), program.inputs = int(p);
  program.outputs = int(W.shape(1)), program.rows = int(limited.shape(0));
  program.R = R.data(), program.G = G.data(), program.d = d.data();
  program.W = W.data(), program.end = end.data(), program.limited = limited.data();
  return program;
}

// H (V, V), A (N rows, V), by_force (N, n, V).
nb::tuple condensed_of(const Cube &R, const Cube &G, const Matrix &d, const Cube &W,
                       const Matrix &end, const Matrix &limited) {
  const TickProgram program = program_of(R, G, d, W, end, limited);
  const std::size_t N = program.N, n = program.n, V = N * program.inputs, rows = program.rows;
  const CondensedProgram found = condense(program);
  return nb::make_tuple(array_of(found.H, {V, V}), array_of(found.A, {N * rows, V}),
                        array_of(found.by_force, {N, n, V}));
}

// x (N, n), g (V), at (N rows).
nb::tuple renewed_of(const Cube &R, const Cube &G, const Matrix &d, const Cube &W,
                     const Matrix &end, const Matrix &limited, const Cube &by_force,
                     const Vector &start, const Matrix &u, const Matrix &wanted) {
  const TickProgram program = program_of(R, G, d, W, end, limited);
  const std::size_t N = program.N, n = program.n, V = N * program.inputs, rows = program.rows;
  expect(by_force.shape(0) == N && by_force.shape(1) == n && by_force.shape(2) == V &&
             start.shape(0) == n && u.shape(0) == N && u.shape(1) == G.shape(2) &&
             wanted.shape(0) == N && wanted.shape(1) == n,
         "vectors of a program with N intervals were expected");
  const TickVectors found = renew(program, by_force.data(), start.data(), u.data(), wanted.data());
  return nb::make_tuple(array_of(found.x, {N, n}), array_of(found.g, {V}),
                        array_of(found.at, {N * rows}));
}

}  // namespace

void add_solve(nb::class_<Mechanics> &type) {
  using namespace nb::literals;
  type.def("equilibrium", &equilibrium_of, "q"_a, "load"_a, "free"_a,
           "q, balance (0 stable, 1 unstable, 2 missing), share borne, sweeps.")
      .def("modes", &modes_of, "q"_a, "free"_a, "count"_a, "load"_a, "shapes"_a = true,
           "Squares [rad^2/s^2] and shapes, if asked for, of the lowest `count`; 0: all.")
      .def("mass", &mass_of, "q"_a, "M(q) (n, n).")
      .def("stiffness", &stiffness_of, "q"_a, "v"_a,
           "Derivative of the forces at q (and rates v, if any) by q, (n, n).")
      .def(
          "force_derivatives", &force_derivatives_of, "q"_a, "v"_a, "a"_a,
          "Of T states: forces (T, n), their derivatives by q, v and a (T, n, n), the tip's places "
          "(T, 2), their derivatives by q (T, 2, n).")
      .def("rates", &rates_of, "q"_a, "v"_a, "Derivative of the forces by v, (n, n).");
}

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
  module.def("condensed_program", &condensed_of, "R"_a, "G"_a, "d"_a, "W"_a, "end"_a, "limited"_a,
             "H, A, by_force of a tick's program.");
  module.def("renewed_program", &renewed_of, "R"_a, "G"_a, "d"_a, "W"_a, "end"_a, "limited"_a,
             "by_force"_a, "start"_a, "u"_a, "wanted"_a,
             "x, g, at of a tick's program from a state on.");
}

}  // namespace flexura
