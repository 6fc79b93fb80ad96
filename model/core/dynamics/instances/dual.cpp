#include "dynamics/inverse_dynamics.hpp"

namespace flexura {

FLEXURA_SWEEPS(, Dual<4>)

}  // namespace flexura
