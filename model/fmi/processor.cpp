// Whether the core inside runs here. Compiled for every processor of the architecture.
#include "bind/processor.hpp"

namespace flexura {

bool processor_suffices() {
#if defined(FLEXURA_NEEDS_V3)
  return has_v3();
#else
  return true;
#endif
}

}  // namespace flexura
