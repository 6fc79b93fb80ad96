// Sampled controllers, gain sweeps, figures of controlled motions.
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "control/board_pulses.hpp"
#include "mechanics.hpp"
#include "packed.hpp"
#include "simulation/gain_sweep.hpp"

namespace flexura {
namespace {

using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

template <class Any>
std::vector<double> numbers(const Any &array) {
  return std::vector<double>(array.data(), array.data() + array.size());
}

// (F, G, L, C, K, Kr, Kv), (offset, hold); none: there is no linear law.
LinearLaw linear_of(const std::vector<Matrix> &matrices, const std::vector<Vector> &about,
                    std::size_t joints) {
  LinearLaw law;
  if (matrices.empty()) return law;
  expect(matrices.size() == 7 && about.size() == 2,
         "a linear law is F, G, L, C, K, Kr, Kv, and offset, hold");
  std::vector<double> *const to[] = {&law.F, &law.G, &law.L, &law.C, &law.K, &law.Kr, &law.Kv};
  for (std::size_t k = 0; k < matrices.size(); ++k) *to[k] = numbers(matrices[k]);
  law.offset = numbers(about[0]), law.hold = numbers(about[1]);
  const std::size_t p = matrices[0].shape(0), m = law.offset.size();
  expect(law.F.size() == p * p && law.G.size() == p * joints && law.L.size() == p * m &&
             law.C.size() == m * p && law.K.size() == joints * p,
         "the matrices of a linear law do not fit each other");
  expect(law.Kr.size() == joints * joints && law.Kv.size() == law.Kr.size() &&
             law.hold.size() == joints && (m == joints || m == joints + 1),
         "the matrices of a linear law do not fit the joints");
  law.states = int(p), law.measurements = int(m);
  return law;
}

// index (N, 5): output, reference from, to, feedforward from, to; gains (N, GAINS); springs (N, 2):
// stiffness, damping.
std::unique_ptr<Controller> controller_of(const Mechanics &mechanics, double rate_Hz,
                                          double quantum, const Matrix &segments,
                                          const Counts &index, const Matrix &gains,
                                          const Matrix &springs, const std::vector<Matrix> &linear,
                                          const std::vector<Vector> &about) {
  const std::size_t joints = mechanics.model->first.size();
  expect(index.shape(0) == joints && index.shape(1) == 5, "index has five numbers a joint");
  expect(gains.shape(0) == joints && gains.shape(1) == GAINS && springs.shape(0) == joints &&
             springs.shape(1) == 2,
         "gains and springs need a row a joint");
  std::vector<JointLaw> all;
  std::vector<Coupling> couplings;
  for (std::size_t i = 0; i < joints; ++i) {
    const std::int64_t *row = index.data() + 5 * i;
    expect(0 <= row[0] && row[0] <= 2, "there is no such output");
    JointLaw joint;
    joint.output = JointLaw::Output(row[0]);
    joint.reference = signal_of(segments, row[1], row[2]),
    joint.feedforward = signal_of(segments, row[3], row[4]);
    all.push_back(std::move(joint));
    couplings.push_back({springs.data()[2 * i], springs.data()[2 * i + 1]});
  }
  auto made = std::make_unique<Controller>(mechanics.model, std::move(all), std::move(couplings),
                                           rate_Hz, quantum, linear_of(linear, about, joints));
  made->set_gains(gains.data());
  return made;
}

// The drives of joints that are not a controller's. index (N, 5): force from, to, motion from, to,
// prescribed; gains (N, 2): kp, kd.
Inputs acting_of(const Matrix &segments, const Counts &index, const Matrix &gains,
                 const Matrix &limits) {
  const std::size_t joints = index.shape(0);
  expect(index.shape(1) == 5 && gains.shape(0) == joints && gains.shape(1) == 2 &&
             limits.shape(0) == joints && limits.shape(1) == 2,
         "index, gains and limits need a row a joint");
  Inputs acting{int(joints)};
  for (std::size_t i = 0; i < joints; ++i) {
    const std::int64_t *row = index.data() + 5 * i;
    JointDrive &drive = acting.joints[i];
    drive.force = signal_of(segments, row[0], row[1]),
    drive.motion = signal_of(segments, row[2], row[3]);
    drive.prescribed = row[4] != 0, drive.kp = gains.data()[2 * i],
    drive.kd = gains.data()[2 * i + 1];
    acting.limit(int(i), limits.data()[2 * i], limits.data()[2 * i + 1]);
  }
  return acting;
}

void check_state(const Controller &self, const Vector &q) {
  expect(q.shape(0) == std::size_t(self.robot().n), "q needs an entry an unknown");
}

void start(Controller &self, const Vector &q) {
  check_state(self, q);
  Inputs acting(self.count());
  self.start(acting, q.data());
}

// What a tick leaves: force (N), and the motion to follow from then on: place, rate and half the
// acceleration (N, 3).
nb::tuple left(const SampledOutput &held) {
  const std::size_t joints = held.force.size();
  Array force = new_array({joints}), motion = new_array({joints, 3});
  std::copy(held.force.begin(), held.force.end(), force.data());
  for (std::size_t i = 0; i < joints; ++i)
    std::copy(held.motion[i].c, held.motion[i].c + 3, motion.data() + 3 * i);
  return nb::make_tuple(force, motion);
}

nb::tuple tick(Controller &self, long k, double t, const Vector &q) {
  check_state(self, q);
  Inputs acting(self.count());
  self.tick(k, t, q.data(), nullptr, acting.held);
  return left(acting.held);
}

nb::tuple step(Controller &self, long k, double t, const Vector &positions, double deflection,
               double slope) {
  expect(positions.shape(0) == std::size_t(self.count()), "positions need an entry a joint");
  Inputs acting(self.count());
  self.step(k, t, positions.data(), Bend{deflection, slope}, acting.held);
  return left(acting.held);
}

// (ticks, N, 6): reference, output as given, three coefficients of what is held, deflection.
Array log_of(const Controller &self) {
  const std::vector<Tick> &log = self.law().log;
  Array out = new_array({std::size_t(self.ticks()), std::size_t(self.count()), 6});
  double *row = out.data();
  for (const Tick &tick : log) {
    *row++ = tick.reference, *row++ = tick.output;
    for (double x : tick.held) *row++ = x;
    *row++ = tick.deflection;
  }
  return out;
}

Array prediction(const Controller &self) {
  const std::vector<double> &z = self.law().predicted();
  Array out = new_array({z.size()});
  std::copy(z.begin(), z.end(), out.data());
  return out;
}

std::unique_ptr<GainSweep> trials_of(const Mechanics &mechanics, const Controller &controller,
                                     const Matrix &segments, const Counts &index,
                                     const Matrix &gains, const Matrix &limits, const Vector &t,
                                     const Vector &q, const Matrix &references, double rtol,
                                     const std::string &method, const nb::object &loads) {
  check_state(controller, q);
  expect(t.shape(0) > 1 && references.shape(0) == std::size_t(controller.count()) &&
             references.shape(1) == t.shape(0),
         "references need a row a joint");
  Plan plan{mechanics.model,
            acting_of(segments, index, gains, limits),
            controller,
            numbers(t),
            numbers(q),
            numbers(references),
            rtol,
            method};
  add_loads(plan.acting, loads);
  nb::gil_scoped_release release;
  return std::make_unique<GainSweep>(std::move(plan));
}

nb::tuple run(GainSweep &self, const Matrix &prices, const Cube &gains, const Vector &limits,
              int threads) {
  const std::size_t rows = limits.shape(0), width = std::size_t(self.plan().figures());
  expect(prices.shape(0) == 2 && prices.shape(1) == width,
         "prices and what is free need an entry a figure");
  expect(gains.shape(0) == rows && gains.shape(1) == std::size_t(self.plan().joints()) &&
             gains.shape(2) == GAINS,
         "gains need a row a joint, and limits an entry a run");
  Array figures = new_array({rows, width}), reached = new_array({rows});
  {
    nb::gil_scoped_release release;
    self.run(Prices{prices.data(), prices.data() + width}, gains.data(), limits.data(), int(rows),
             threads, figures.data(), reached.data());
  }
  return nb::make_tuple(figures, reached);
}

Samples samples_of(const Vector &t, const Vector &a, const Vector &b) {
  expect(t.shape(0) > 0 && a.shape(0) == t.shape(0) && b.shape(0) == t.shape(0),
         "samples need an entry an instant");
  return {t.data(), int(t.shape(0))};
}

Array joint_figures_of(const Vector &t, const Vector &r, const Vector &q) {
  Array out = new_array({JOINT_FIGURES});
  joint_metrics(samples_of(t, r, q), r.data(), q.data(), out.data());
  return out;
}

Array strip_figures_of(const Vector &t, const Vector &w, double settled) {
  Array out = new_array({STRIP_FIGURES});
  strip_metrics(samples_of(t, w, w), w.data(), settled, out.data());
  return out;
}

double least_vibration_of(const Vector &t, const Vector &w, int seen, double enough) {
  const Samples at = samples_of(t, w, w);
  expect(0 <= seen && seen <= at.count, "there are not so many samples");
  return vibration_lower_bound(at, w.data(), seen, enough);
}

// knots (K, 4): positions of both joints, velocities of both.
nb::tuple board_pulses_of(const Vector &settings, bool open_loop, int period_log2,
                          const Counts &knots, std::int32_t given, int ticks) {
  expect(int(settings.shape(0)) == board::settings_count(), "expected all settings of the board");
  expect(knots.shape(0) > 0 && knots.shape(1) == 4, "expected knots of four numbers");
  expect(0 <= period_log2 && period_log2 <= 6 && ticks >= 0, "expected a period of 1 to 64 ticks");
  std::vector<board::KnotRow> rows;
  const std::int64_t *data = knots.data();
  for (std::size_t k = 0; k < knots.shape(0); ++k, data += 4)
    rows.push_back({{data[0], data[1]}, {data[2], data[3]}});
  const board::Pulses found =
      board::step_pulses(std::vector<float>(settings.data(), settings.data() + settings.size()),
                         open_loop, period_log2, rows, given, ticks);
  if (found.wrong_setting >= 0)
    throw std::invalid_argument("the firmware refuses setting number " +
                                std::to_string(found.wrong_setting));
  Array at = new_array({found.at.size()}), direction = new_array({found.at.size()});
  std::copy(found.at.begin(), found.at.end(), at.data());
  std::copy(found.direction.begin(), found.direction.end(), direction.data());
  return nb::make_tuple(at, direction);
}

}  // namespace

void bind_control(nb::module_ &module) {
  using namespace nb::literals;
  nb::class_<Controller, Sampler>(
      module, "Controller",
      "A sampled controller of all joints of one robot, with its memory and log.")
      .def(nb::new_(&controller_of), "mechanics"_a, "rate_Hz"_a, "quantum"_a, "segments"_a,
           "index"_a, "gains"_a, "springs"_a, "linear"_a, "about"_a)
      .def("start", &start, "q"_a, "As before tick 0, on a robot that starts at q.")
      .def("tick", &tick, "k"_a, "t"_a, "q"_a,
           "Tick k at the state q: forces (N,), and motions (N, 3) that hold from then on.")
      .def("step", &step, "k"_a, "t"_a, "positions"_a, "deflection"_a, "slope"_a,
           "The same from what is measured.")
      .def_prop_ro("log", &log_of, nb::rv_policy::move,
                   "Of all ticks since the start, (ticks, N, 6).")
      .def_prop_ro("prediction", &prediction, nb::rv_policy::move,
                   "z of a linear law for the next tick.");
  nb::class_<GainSweep>(module, "GainSweep",
                        "One robot under many controllers; may be called from several threads.")
      .def(nb::new_(&trials_of), "mechanics"_a, "controller"_a, "segments"_a, "index"_a, "gains"_a,
           "limits"_a, "t"_a, "q"_a, "references"_a, "rtol"_a, "method"_a, "loads"_a = nb::none())
      .def("run", &run, "prices"_a, "gains"_a, "limits"_a, "threads"_a);
  module.def("board_pulses", &board_pulses_of, "settings"_a, "open_loop"_a, "period_log2"_a,
             "knots"_a, "given"_a, "ticks"_a,
             "Counts of the step timer and directions of joint 2's pulses, by the firmware.");
  module.def("joint_metrics", &joint_figures_of, "t"_a, "r"_a, "q"_a);
  module.def("strip_metrics", &strip_figures_of, "t"_a, "w"_a, "settled"_a);
  module.def("vibration_lower_bound", &least_vibration_of, "t"_a, "w"_a, "seen"_a, "enough"_a);
}

}  // namespace flexura
