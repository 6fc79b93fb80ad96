#include "integration/time_loop.hpp"

namespace flexura {

template class Loop<double>;
template class Loop<Pack<4>>;

}  // namespace flexura
