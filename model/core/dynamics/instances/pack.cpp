#include "dynamics/inverse_dynamics.hpp"

namespace flexura {

FLEXURA_SWEEPS(, Pack<4>)

}  // namespace flexura
