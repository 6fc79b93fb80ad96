// What all files of the Python module share.
//
// Arrays go in as Vector or Matrix: contiguous float64 in memory that C++ reads in place. nanobind
// copies arrays of another type or order first, and refuses another number of dimensions, lists and
// None with a TypeError; an array that C++ writes to must therefore be bound with .noconvert().
// Arrays come out as `new_array`, which Python then owns. A function that takes longer than
// microseconds releases Python's lock (nb::gil_scoped_release) and touches no Python object
// meanwhile.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <initializer_list>
#include <stdexcept>

namespace flexura {

namespace nb = nanobind;

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Array = nb::ndarray<nb::numpy, double, nb::c_contig>;

// Refuses arrays that do not fit each other.
inline void expect(bool good, const char *text) {
  if (!good) throw std::invalid_argument(text);
}

// An array of zeros that NumPy owns.
inline Array new_array(std::initializer_list<std::size_t> shape) {
  std::size_t count = 1;
  for (std::size_t n : shape) count *= n;
  double *data = new double[count]();
  nb::capsule owner(data, [](void *p) noexcept { delete[] static_cast<double *>(p); });
  return Array(data, shape.size(), shape.begin(), owner);
}

void bind_mechanics(nb::module_ &module);   // mechanics.cpp
void bind_simulation(nb::module_ &module);  // simulation.cpp
void bind_control(nb::module_ &module);     // control.cpp, after simulation.cpp
void bind_population(nb::module_ &module);  // population.cpp, after mechanics.cpp
void bind_prediction(nb::module_ &module);  // solve.cpp, after mechanics.cpp

}  // namespace flexura
