// The methods of the time loop by their names. What uses them sees the interface `Method` alone:
// each method is compiled once, for one robot and for four.
#pragma once
#include <memory>
#include <string>

#include "integration/method.hpp"
#include "integration/run_state.hpp"

namespace flexura {

constexpr double SHARPEST = 1e-9;  // tolerances below are for explicit steps

// The first step to try, as a share of the whole run's time.
constexpr double FIRST_STEP = 1e-4;

// "explicit", "implicit" or "exponential"; under a sampled controller also "explicit-3",
// "explicit-5", "implicit-2". Null for any other name.
template <class Real>
std::unique_ptr<Method<Real>> make_method(const std::string &name, Integration<Real> &integration,
                                          double rtol = 1e-6,
                                          const ExponentialOptions &options = ExponentialOptions());

// Which method suits a run under a controller of short ticks, by passes a tick; `fastest`: the
// robot's highest frequency or rate of decay [rad/s].
constexpr double LOOSE = 1e-4;  // tolerances above are for implicit steps of order 2
const char *method_for_ticks(double rate_Hz, double fastest, double rtol);

// Why a run ended where it did, in a sentence, and what to try: for every status but `running` and
// `done`. `joint` counts from 1.
std::string explain(const RunState &run_state, const std::string &method, double rtol);

}  // namespace flexura
