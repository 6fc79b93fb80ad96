// What the processor can do, for flexura/core.py. Compiled for every processor of the architecture.
#include "processor.hpp"

#include <nanobind/nanobind.h>

NB_MODULE(_processor, m) {
  m.def("has_v3", &flexura::has_v3,
        "Whether this processor has all instructions of the level x86-64-v3.");
}
