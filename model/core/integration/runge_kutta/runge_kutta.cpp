// The methods of this folder, for one robot and for four.
#include "integration/runge_kutta/dop853.hpp"
#include "integration/runge_kutta/embedded_pairs.hpp"
#include "integration/runge_kutta/implicit.hpp"

namespace flexura {

template class Explicit<double>;
template class Explicit<Pack<4>>;
template class Implicit<double>;
template class Implicit<Pack<4>>;
template class EmbeddedPairSteps<double>;

}  // namespace flexura
