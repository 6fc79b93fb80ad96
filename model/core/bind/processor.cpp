// What the processor can do, for flexura/core.py. Compiled for every processor of the architecture.
#include <nanobind/nanobind.h>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

// Whether the processor and the operating system have all instructions of the level x86-64-v3.
static bool has_v3() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") &&
                    __builtin_cpu_supports("bmi2");  // these look at the operating system too
  unsigned a = 0, b = 0, basic = 0, extended = 0, d = 0;
  __get_cpuid(1, &a, &b, &basic, &d);
  __get_cpuid(0x80000001u, &a, &b, &extended, &d);
  const unsigned movbe = 1u << 22, f16c = 1u << 29, lzcnt = 1u << 5;
  return wide && (basic & movbe) && (basic & f16c) && (extended & lzcnt);
#else
  return false;
#endif
}

NB_MODULE(_processor, m) {
  m.def("has_v3", &has_v3, "Whether this processor has all instructions of the level x86-64-v3.");
}
