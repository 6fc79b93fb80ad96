// Statics and small motions of a robot's equations.
#include <nanobind/stl/vector.h>

#include "mechanics.hpp"
#include "statics_and_modes/equilibrium.hpp"
#include "statics_and_modes/force_derivatives.hpp"
#include "statics_and_modes/natural_modes.hpp"

namespace flexura {
namespace {

using Flags = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void check_state(const Mechanics &self, const Vector &q) {
  if (q.shape(0) != std::size_t(self.model->n))
    throw std::invalid_argument("q needs an entry an unknown");
}

TipLoad load_of(const Vector &load) {
  if (load.shape(0) != 3) throw std::invalid_argument("a load is two forces and a moment");
  TipLoad out;
  out.force[0] = load.data()[0], out.force[1] = load.data()[1], out.moment = load.data()[2];
  return out;
}

std::vector<char> free_joints(const Mechanics &self, const Flags &free) {
  if (free.shape(0) != self.model->first.size())
    throw std::invalid_argument("a flag a joint was expected");
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
    if (x->shape(1) != n || x->shape(0) != count)
      throw std::invalid_argument("q, v and a need a row a state and a column an unknown");
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

}  // namespace flexura
