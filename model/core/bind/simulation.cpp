// The time loop: a run that is begun, advanced and read from Python.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>

#include "control/controller.hpp"
#include "dynamics/places/outputs.hpp"
#include "mechanics.hpp"
#include "packed.hpp"
#include "simulation/simulation.hpp"

namespace flexura {
namespace {

// A DriveFunction of Python's as the core calls it.
class PythonDrive {
 public:
  PythonDrive(std::shared_ptr<const Model<double>> model, const nb::object &drive)
      : model_(std::move(model)),
        work_(*model_),
        link_(last_flexible(*model_)),
        function_(drive.attr("function")),
        read_(drive.attr("read")),
        of_time_(nb::cast<bool>(drive.attr("of_time"))),
        of_state_(nb::cast<bool>(drive.attr("of_state"))) {}

  // Forces (joints) at a state. The GIL is held.
  void call(double t, const double *q, const double *v, double *force) {
    if (of_time_) return take(function_(t), t, force);
    if (of_state_) {
      const std::size_t n = std::size_t(model_->n);
      Array place = new_array({n}), rate = new_array({n});
      std::copy_n(q, n, place.data()), std::copy_n(v, n, rate.data());
      return take(function_(t, place, rate), t, force);
    }
    const std::size_t joints = model_->first.size();
    Array position = new_array({joints}), velocity = new_array({joints});
    for (std::size_t i = 0; i < joints; ++i)
      position.data()[i] = q[model_->first[i]], velocity.data()[i] = v[model_->first[i]];
    const double deflection = link_ < 0 ? 0.0 : bend(*model_, work_, q, link_).deflection;
    take(function_(t, position, velocity, deflection), t, force);
  }

 private:
  std::shared_ptr<const Model<double>> model_;
  Workspace<double> work_;
  int link_;
  nb::object function_, read_;
  bool of_time_, of_state_;

  // Arrays of finite doubles are read in place; all else by Python, which refuses what cannot be
  // forces.
  void take(const nb::object &given, double t, double *force) const {
    if (take_array(given, force)) return;
    const nb::object checked = read_(given, t);
    if (!take_array(checked, force))
      throw std::invalid_argument("the drive function gives another number of forces");
  }
  bool take_array(const nb::object &given, double *force) const {
    Py_buffer view;
    if (!PyObject_CheckBuffer(given.ptr())) return false;
    if (PyObject_GetBuffer(given.ptr(), &view, PyBUF_ND | PyBUF_FORMAT | PyBUF_C_CONTIGUOUS) != 0)
      return PyErr_Clear(), false;
    const std::size_t joints = model_->first.size();
    const bool doubles = std::strcmp(view.format, "d") == 0 && view.ndim == 1 &&
                         std::size_t(view.shape[0]) == joints;
    bool finite = doubles;
    for (std::size_t i = 0; doubles && i < joints; ++i)
      force[i] = static_cast<const double *>(view.buf)[i],
      finite = finite && std::isfinite(force[i]);
    PyBuffer_Release(&view);
    return finite;
  }
};

// A Python function that is called once a tick.
class PythonSampler : public Sampler {
 public:
  PythonSampler(const Mechanics &robot, const nb::object &drive) : drive_(robot.model, drive) {}
  void tick(long, double t, const double *q, const double *v, SampledOutput &held) override {
    nb::gil_scoped_acquire lock;
    drive_.call(t, q, v, held.force.data());
  }

 private:
  PythonDrive drive_;
};

// A run and what Python objects it needs.
struct Running {
  // a DriveFunction, a tuple of contacts or None; a Sampler or None: kept alive
  nb::object function, sampler;
  std::unique_ptr<PythonDrive> drive;
  std::unique_ptr<Simulation> run;

  Running(const Mechanics &robot, const Vector &t, const Vector &q, const Vector &v, double rtol,
          const std::string &method, const Matrix &segments, const Ranges &ranges,
          const Matrix &gains, const Flags &prescribed, const Flags &sampled, const Matrix &limits,
          nb::object function_, nb::object sampler_, double rate_Hz, double first_step,
          bool numerical_damping, long most_steps, const nb::object &loads)
      : function(std::move(function_)), sampler(std::move(sampler_)) {
    const std::size_t n = std::size_t(robot.model->n);
    expect(q.shape(0) == n && v.shape(0) == n && t.shape(0) >= 1 &&
               ranges.shape(0) == robot.model->first.size(),
           "a run of another robot was expected");
    Inputs acting = acting_of(segments, ranges, gains, prescribed, sampled, limits);
    add_loads(acting, loads);
    if (nb::isinstance<nb::tuple>(function)) {  // of contacts: as backlash_of takes them
      const nb::tuple parts = nb::cast<nb::tuple>(function);
      acting.function =
          backlash_of(nb::cast<Matrix>(parts[0]), nb::cast<Matrix>(parts[1]), robot.model->first);
    } else if (!function.is_none()) {
      drive = std::make_unique<PythonDrive>(robot.model, function);
      acting.function = [this](double at, const double *place, const double *rate, double *force) {
        nb::gil_scoped_acquire lock;
        drive->call(at, place, rate, force);
      };
    }
    if (!sampler.is_none()) {
      acting.sampler = nb::cast<Sampler *>(sampler);
      acting.rate_Hz = rate_Hz;
    }
    if (auto *controller = dynamic_cast<Controller *>(acting.sampler))
      controller->start(acting, q.data());
    Request request;
    request.times = {t.data(), t.data() + t.shape(0)}, request.q = {q.data(), q.data() + n},
    request.v = {v.data(), v.data() + n};
    request.rtol = rtol, request.method = method, request.first_step = first_step,
    request.numerical_damping = numerical_damping, request.most_steps = most_steps;
    run = std::make_unique<Simulation>(robot.model, std::move(acting), request);
  }

  bool advance(long steps) {
    nb::gil_scoped_release release;
    return run->advance(steps);
  }

  nb::dict progress() const {
    const RunState &c = run->run_state();
    nb::dict out;
    out["status"] = word(c.status), out["t"] = c.t, out["steps"] = c.steps,
    out["rejected"] = c.rejected;
    out["passes"] = run->passes(), out["method"] = run->method();
    out["joint"] = c.joint, out["elastic"] = c.elastic, out["rate"] = c.rate;
    return out;
  }

  // Times (R,), states (R, 2 n), accounts (R, 4), drive forces (R, joints) of the rows so far.
  nb::tuple rows() const {
    const Record &r = run->record();
    const std::size_t R = std::size_t(r.rows), size = std::size_t(r.size),
                      wide = 2 * std::size_t(run->model().n), joints = std::size_t(r.joints);
    Array t = new_array({R}), states = new_array({R, wide}), accounts = new_array({R, size - wide}),
          drive = new_array({R, joints});
    std::copy_n(r.t.begin(), R, t.data()), std::copy_n(r.drive.begin(), R * joints, drive.data());
    for (std::size_t k = 0; k < R; ++k) {
      std::copy_n(r.state.begin() + std::ptrdiff_t(k * size), wide, states.data() + k * wide);
      std::copy_n(r.state.begin() + std::ptrdiff_t(k * size + wide), size - wide,
                  accounts.data() + k * (size - wide));
    }
    return nb::make_tuple(t, states, accounts, drive);
  }

  Array state() const {
    const std::vector<double> z = run->state();
    Array out = new_array({z.size()});
    std::copy(z.begin(), z.end(), out.data());
    return out;
  }
};

Array bends_of(const Mechanics &self, const Matrix &q, int link) {
  expect(q.shape(1) == std::size_t(self.model->n), "q needs a column an unknown");
  expect(0 <= link && link < self.model->links(), "there is no such link");
  Workspace<double> work(*self.model);
  Array out = new_array({q.shape(0), 2});
  for (std::size_t k = 0; k < q.shape(0); ++k) {
    const Bend b = bend(*self.model, work, q.data() + k * q.shape(1), link);
    out.data()[2 * k] = b.deflection, out.data()[2 * k + 1] = b.slope;
  }
  return out;
}

}  // namespace

void bind_simulation(nb::module_ &module) {
  using namespace nb::literals;
  nb::class_<Sampler>(module, "Sampler", "A sampled controller.");
  nb::class_<PythonSampler, Sampler>(module, "PythonSampler",
                                     "A DriveFunction that is called once a tick.")
      .def(nb::init<const Mechanics &, const nb::object &>(), "robot"_a, "drive"_a);
  nb::class_<Running>(module, "Simulation", "A run in progress.")
      .def(nb::init<const Mechanics &, const Vector &, const Vector &, const Vector &, double,
                    const std::string &, const Matrix &, const Ranges &, const Matrix &,
                    const Flags &, const Flags &, const Matrix &, nb::object, nb::object, double,
                    double, bool, long, const nb::object &>(),
           "robot"_a, "t"_a, "q"_a, "v"_a, "rtol"_a, "method"_a, "segments"_a, "ranges"_a,
           "gains"_a, "prescribed"_a, "sampled"_a, "limits"_a, "function"_a.none(),
           "sampler"_a.none(), "rate_Hz"_a, "first_step"_a, "numerical_damping"_a, "most_steps"_a,
           "loads"_a = nb::none())
      .def("advance", &Running::advance, "steps"_a, "At most so many steps further; may it go on?")
      .def("progress", &Running::progress, "How far the run is, and how it ended.")
      .def("rows", &Running::rows, "Times, states, accounts and drive forces so far.")
      .def("state", &Running::state, "The state where the run is, accounts included.");
  module.def("bends", &bends_of, "robot"_a, "q"_a, "link"_a,
             "Tip deflection and slope (T, 2) of a link at q (T, n).");
}

}  // namespace flexura
