// The Python module: entry point, how the core was built, and its elementary functions on arrays.
// Each other subject has a file with a function that adds what it binds.
#include "bind.hpp"
#include "numbers/build_info.hpp"
#include "numbers/scalars.hpp"

namespace flexura {

namespace {

// f of every number; in packs of four if `packed`, the last one filled up with zeros.
template <class Function>
void apply(const double *x, double *y, std::size_t count, bool packed, Function f) {
  if (!packed) {
    for (std::size_t k = 0; k < count; ++k) y[k] = f(x[k]);
    return;
  }
  for (std::size_t k = 0; k < count; k += 4) {
    Pack<4> pack(0.0);
    for (std::size_t lane = 0; lane < 4 && k + lane < count; ++lane)
      pack.set(static_cast<int>(lane), x[k + lane]);
    const Pack<4> result = f(pack);
    for (std::size_t lane = 0; lane < 4 && k + lane < count; ++lane)
      y[k + lane] = result[static_cast<int>(lane)];
  }
}

template <class Function>
Array on_array(const Vector &x, bool packed, Function f) {
  Array y = new_array({x.shape(0)});
  apply(x.data(), y.data(), x.shape(0), packed, f);
  return y;
}

Array sin_array(const Vector &x, bool packed) {
  return on_array(x, packed, [](auto z) {
    decltype(z) s, c;
    sincos(z, s, c);
    return s;
  });
}
Array cos_array(const Vector &x, bool packed) {
  return on_array(x, packed, [](auto z) {
    decltype(z) s, c;
    sincos(z, s, c);
    return c;
  });
}
Array exp_array(const Vector &x, bool packed) {
  return on_array(x, packed, [](auto z) { return flexura::exp(z); });
}
Array log_array(const Vector &x, bool packed) {
  return on_array(x, packed, [](auto z) { return flexura::log(z); });
}
Array tanh_array(const Vector &x, bool packed) {
  return on_array(x, packed, [](auto z) { return flexura::tanh(z); });
}

}  // namespace

static void bind_numbers(nb::module_ &module) {
  using namespace nb::literals;
  module.def("sin", &sin_array, "x"_a, "packed"_a = false, "sin x [rad] of a vector.");
  module.def("cos", &cos_array, "x"_a, "packed"_a = false, "cos x [rad] of a vector.");
  module.def("exp", &exp_array, "x"_a, "packed"_a = false, "e^x of a vector.");
  module.def("log", &log_array, "x"_a, "packed"_a = false,
             "ln x of a vector; nan for x < 2.2e-308.");
  module.def("tanh", &tanh_array, "x"_a, "packed"_a = false, "tanh x of a vector.");
}

}  // namespace flexura

#define MODULE(name, variable) \
  NB_MODULE(name, variable)  // so that a macro's value becomes the name

MODULE(FLEXURA_MODULE_NAME, module) {
  module.attr("level") = flexura::build_level();
  module.attr("bindings") = FLEXURA_BINDINGS;
  module.attr("compiler") = flexura::build_compiler();
  module.attr("portable") = flexura::build_portable();
  flexura::bind_numbers(module);
  flexura::bind_mechanics(module);
  flexura::bind_simulation(module);
  flexura::bind_control(module);
  flexura::bind_population(module);
  flexura::bind_prediction(module);
}
