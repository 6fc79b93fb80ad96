#include "newton_euler.hpp"

namespace flexura {

FLEXURA_SWEEPS(, Dual<4>)

}  // namespace flexura
