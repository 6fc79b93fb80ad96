// A robot's equations: from flat arrays of its constants to forward and inverse dynamics, energies,
// places.
#include "mechanics.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "dynamics/places/outputs.hpp"
#include "dynamics/places/point_loads.hpp"
#include "packed.hpp"
#include "robot/input_fault.hpp"
#include "robot/robot_table.hpp"

namespace flexura {
namespace {

Array accelerations(const Mechanics &self, const Vector &q, const Vector &v, const Vector &force) {
  const Model<double> &model = *self.model;
  const std::size_t n = std::size_t(model.n), links = model.first.size();
  expect(q.shape(0) == n && v.shape(0) == n && force.shape(0) == n,
         "q, v and force need an entry an unknown");
  Workspace<double> work(model);
  const std::vector<double> given(links, 0.0);
  std::vector<double> reaction(links, 0.0);
  Array a = new_array({n});
  const Stage<double> plain{q.data(), v.data(), 0.0, 0.0, nullptr, nullptr};
  accelerate(model, work, q.data(), v.data(), plain, force.data(),
             Held<double>{model.locked.data(), given.data(), reaction.data()}, a.data());

  return a;
}

Array inverse_dynamics(const Mechanics &self, const Vector &q, const Vector &v, const Vector &a,
                       bool gravity, bool stiffness, bool damping) {
  const Model<double> &model = *self.model;
  const std::size_t n = std::size_t(model.n);
  expect(q.shape(0) == n && v.shape(0) == n && a.shape(0) == n,
         "q, v and a need an entry an unknown");
  Workspace<double> work(model);
  Array out = new_array({n});
  forces(model, work, q.data(), v.data(), a.data(), Terms{gravity, stiffness, damping}, out.data());
  return out;
}

Array observations(const Mechanics &self, const Matrix &q, const Matrix &v, int stations) {
  const Model<double> &model = *self.model;
  expect(q.shape(1) == std::size_t(model.n) && v.shape(1) == q.shape(1) && v.shape(0) == q.shape(0),
         "q and v need a column an unknown");
  Observer<double> observer(model, stations);
  Array out = new_array({q.shape(0), std::size_t(observer.columns())});
  {
    nb::gil_scoped_release free;
    for (std::size_t k = 0; k < q.shape(0); ++k)
      observer.observe(q.data() + k * q.shape(1), v.data() + k * q.shape(1),
                       out.data() + k * std::size_t(observer.columns()));
  }
  return out;
}

Array line_of(const Mechanics &self, const Vector &q, int link, const Vector &s) {
  const Model<double> &model = *self.model;
  expect(q.shape(0) == std::size_t(model.n), "q needs an entry an unknown");
  expect(0 <= link && link < model.links(), "there is no such link");
  Workspace<double> work(model);
  const std::vector<double> still(std::size_t(model.n), 0.0);
  outward_kinematics(model, work, q.data(), still.data());
  std::vector<Pose<double>> poses(s.shape(0));
  line_points(model, work, q.data(), link, s.data(), int(s.shape(0)), poses.data());
  Array out = new_array({s.shape(0), 3});
  for (std::size_t k = 0; k < poses.size(); ++k)
    out.data()[3 * k] = poses[k].x, out.data()[3 * k + 1] = poses[k].y,
                   out.data()[3 * k + 2] = poses[k].angle;
  return out;
}

// Generalised forces (T, n) of loads at q (T, n): rows of `load_places_of`, values (T, 3 L).
Array load_forces(const Mechanics &self, const Matrix &q, const Matrix &rows,
                  const Matrix &values) {
  const Model<double> &model = *self.model;
  const std::vector<LoadPlace> places = load_places_of(rows, model.links());
  expect(q.shape(1) == std::size_t(model.n) && values.shape(0) == q.shape(0) &&
             values.shape(1) == 3 * places.size(),
         "a row a state, a column an unknown, three values a load were expected");
  Workspace<double> work(model);
  Array out = new_array({q.shape(0), q.shape(1)});
  for (std::size_t k = 0; k < q.shape(0); ++k)
    add_point_loads(model, work, places.data(), int(places.size()),
                    values.data() + k * values.shape(1), q.data() + k * q.shape(1),
                    out.data() + k * q.shape(1));
  return out;
}

double loss_of(const Mechanics &self, const Vector &q, const Vector &v) {
  expect(q.shape(0) == std::size_t(self.model->n) && v.shape(0) == q.shape(0),
         "q and v need an entry an unknown");
  return loss(*self.model, q.data(), v.data());
}

// Constants of the piece that a whole link is: B (m, P), K (m), shapes at the tip (m); the shapes
// as sums of Legendre's polynomials (rows, m), no rows where nothing slides along it.
nb::tuple whole_link(const Mechanics &self, int link) {
  const Model<double> &model = *self.model;
  expect(0 <= link && link < model.links(), "there is no such link");
  const Piece<double> &c = model.pieces[std::size_t(model.begin[std::size_t(link) + 1]) - 1];
  Array B = new_array({std::size_t(c.m), std::size_t(c.P)}), K = new_array({std::size_t(c.m)}),
        tip = new_array({std::size_t(c.m)});
  for (int i = 0; i < c.m; ++i) {
    for (int j = 0; j < c.P; ++j) B.data()[i * c.P + j] = c.B[i * padded(c.P) + j];
    K.data()[i] = c.K[i], tip.data()[i] = c.tip_angle[i];
  }
  Array sums = new_array({std::size_t(c.rail), std::size_t(c.m)});
  for (int n = 0; n < c.rail; ++n)
    for (int i = 0; i < c.m; ++i) sums.data()[n * c.m + i] = c.rails[n * (c.P + c.m) + c.P + i];
  return nb::make_tuple(B, K, tip, sums);
}

}  // namespace

Robot robot_of(const Vector &gravity, const Vector &payload, const Counts &counts,
               const Matrix &numbers, const Matrix &material, const Matrix &lumps) {
  expect(gravity.size() == 2 && payload.size() == PAYLOAD,
         "gravity has two numbers, the payload four");
  expect(counts.shape(1) == COUNTS && numbers.shape(1) == NUMBERS &&
             material.shape(1) == MATERIAL && lumps.shape(1) == LUMP,
         "rows of other lengths were expected");
  expect(counts.shape(0) == numbers.shape(0), "counts and numbers need a row a link");
  Table table;
  table.links = int(counts.shape(0)), table.intervals = int(material.shape(0)),
  table.lumps = int(lumps.shape(0)), table.lump = lumps.data();
  table.counts = counts.data(), table.numbers = numbers.data(), table.material = material.data();
  table.gravity = gravity.data(), table.payload = payload.data();
  return robot_of(table, 0);
}

void bind_mechanics(nb::module_ &module) {
  using namespace nb::literals;
  static nb::exception<Fault> fault(module, "Fault", PyExc_ValueError);
  nb::register_exception_translator([](const std::exception_ptr &thrown, void *) {
    try {
      std::rethrow_exception(thrown);
    } catch (const Fault &what) {
      PyErr_SetObject(fault.ptr(), nb::make_tuple(what.link, what.key, what.what()).ptr());
    }
  });
  nb::class_<Mechanics> type(module, "Mechanics", "The equations of one robot.");
  type.def(nb::init<const Vector &, const Vector &, const Counts &, const Matrix &, const Matrix &,
                    const Matrix &>(),
           "gravity"_a, "payload"_a, "counts"_a, "numbers"_a, "material"_a, "lumps"_a)
      .def_prop_ro(
          "n", [](const Mechanics &self) { return self.model->n; }, "How many unknowns there are.")
      .def_prop_ro(
          "first", [](const Mechanics &self) { return self.model->first; }, "Rows of the joints.")
      .def_prop_ro(
          "elastic", [](const Mechanics &self) { return self.model->elastic; },
          "Elastic unknowns of each link.")
      .def("pieces",
           [](const Mechanics &self, int link) {
             return self.model->begin.at(std::size_t(link) + 1) -
                    self.model->begin.at(std::size_t(link));
           })
      .def("accelerations", &accelerations, "q"_a, "v"_a, "force"_a)
      .def("forces", &inverse_dynamics, "q"_a, "v"_a, "a"_a, "gravity"_a, "stiffness"_a,
           "damping"_a)
      .def("observe", &observations, "q"_a, "v"_a, "stations"_a)
      .def("loads", &load_forces, "q"_a, "rows"_a, "values"_a,
           "Generalised forces (T, n) of forces and moments on links.")
      .def("line", &line_of, "q"_a, "link"_a, "s"_a)
      .def("loss", &loss_of, "q"_a, "v"_a)
      .def("whole_link", &whole_link, "link"_a);
  add_solve(type);
}

}  // namespace flexura
