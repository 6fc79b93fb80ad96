#include "newton_euler.hpp"

namespace flexura {

FLEXURA_SWEEPS(, double)

}  // namespace flexura
