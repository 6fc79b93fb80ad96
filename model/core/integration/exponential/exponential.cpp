#include "integration/exponential/exponential.hpp"

namespace flexura {

template class Exponential<double>;
template class Exponential<Pack<4>>;

}  // namespace flexura
