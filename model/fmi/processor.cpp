// Whether the core inside runs here. Compiled for every processor of the architecture.
// (No header of the core: its functions might be compiled here for all processors.)

namespace flexura {

bool processor_suffices();  // as instance.hpp has it

bool processor_suffices() {
#if defined(FLEXURA_NEEDS_V3)
  __builtin_cpu_init();  // these look at the operating system too
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
#else
  return true;
#endif
}

}  // namespace flexura
