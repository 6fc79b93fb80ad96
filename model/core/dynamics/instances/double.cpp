#include "dynamics/inverse_dynamics.hpp"

namespace flexura {

FLEXURA_SWEEPS(, double)

}  // namespace flexura
