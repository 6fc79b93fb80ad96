#include "control/model_plant.hpp"

namespace flexura {

template class ModelPlant<double>;
template class ModelPlant<Pack<4>>;

}  // namespace flexura
