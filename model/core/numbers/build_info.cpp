#include "numbers/build_info.hpp"

namespace flexura {

const char *build_level() { return FLEXURA_LEVEL; }

const char *build_compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "g++ " __VERSION__;
#else
  return "another compiler";
#endif
}

bool build_portable() {
#ifdef FLEXURA_PORTABLE
  return true;
#else
  return false;
#endif
}

}  // namespace flexura
