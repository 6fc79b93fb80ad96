#include "newton_euler.hpp"

namespace flexura {

FLEXURA_SWEEPS(, Pack<4>)

}  // namespace flexura
