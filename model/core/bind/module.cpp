// The Python module: entry point and how the core was built. Each subject has a file with a function that
// adds what it binds.
#include "bind.hpp"
#include "build.hpp"

#define MODULE(name, variable) NB_MODULE(name, variable)  // so that a macro's value becomes the name

MODULE(FLEXURA_MODULE_NAME, module) {
  module.attr("level") = flexura::build_level();
  module.attr("compiler") = flexura::build_compiler();
  module.attr("portable") = flexura::build_portable();
  flexura::bind_numbers(module);
  flexura::bind_mechanics(module);
  flexura::bind_simulation(module);
  flexura::bind_control(module);
  flexura::bind_population(module);
}
