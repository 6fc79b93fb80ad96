// The functions of FMI 3.0 for co-simulation (Functional Mock-up Interface Specification 3.0.2),
// declared here as the standard says. Those that the FMU has no use for answer with an error.
#include <cstddef>
#include <cstdint>

#include "fmi/instance.hpp"

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using flexura::CoSimulation;
using flexura::Instance;

using Component = void *;
using Reference = std::uint32_t;
using Text = const char *;
using Binary = const std::uint8_t *;
using Log = void (*)(void *environment, int status, Text category, Text message);
enum Status { OK, WARNING, DISCARD, ERROR, FATAL };

Instance &of(Component c) { return *static_cast<Instance *>(c); }

template <class Function>
Status call(Component c, Function f) {
  return of(c).good(f) ? OK : ERROR;
}

Status lacking(Component c, Text what) {
  of(c).log(std::string("the FMU has no ") + what);
  return ERROR;
}

}  // namespace

EXPORT Text fmi3GetVersion() { return "3.0"; }
EXPORT Status fmi3SetDebugLogging(Component, bool, std::size_t, const Text *) { return OK; }

EXPORT Component fmi3InstantiateCoSimulation(Text, Text token, Text resources, bool, bool, bool,
                                             bool, const Reference *, std::size_t,
                                             void *environment, Log logger, void *) {
  if (!flexura::processor_suffices()) {
    if (logger) logger(environment, ERROR, "logStatusError", flexura::OLD_PROCESSOR);
    return nullptr;
  }
  auto log = [logger, environment](const std::string &text) {
    if (logger) logger(environment, ERROR, "logStatusError", text.c_str());
  };
  return flexura::make_instance(resources, token, log).release();
}
EXPORT Component fmi3InstantiateModelExchange(Text, Text, Text, bool, bool, void *environment,
                                              Log logger) {
  if (logger) logger(environment, ERROR, "logStatusError", "the FMU is for co-simulation only");
  return nullptr;
}
EXPORT Component fmi3InstantiateScheduledExecution(Text, Text, Text, bool, bool, void *environment,
                                                   Log logger, void *, void *, void *) {
  if (logger) logger(environment, ERROR, "logStatusError", "the FMU is for co-simulation only");
  return nullptr;
}
EXPORT void fmi3FreeInstance(Component c) { delete static_cast<Instance *>(c); }

EXPORT Status fmi3EnterInitializationMode(Component c, bool tolerance_defined, double tolerance,
                                          double start, bool stop_defined, double stop) {
  return call(c, [&](CoSimulation &robot) {
    if (tolerance_defined) robot.set_tolerance(tolerance);
    robot.schedule(start, stop_defined ? stop : std::numeric_limits<double>::infinity());
  });
}
EXPORT Status fmi3ExitInitializationMode(Component c) {
  return call(c, [](CoSimulation &robot) { robot.start(); });
}
EXPORT Status fmi3Terminate(Component) { return OK; }
EXPORT Status fmi3Reset(Component c) {
  Instance &instance = of(c);
  return call(
      c, [&](CoSimulation &) { instance.robot = std::make_unique<CoSimulation>(instance.file); });
}

EXPORT Status fmi3GetFloat64(Component c, const Reference *which, std::size_t count, double *values,
                             std::size_t) {
  return call(c, [&](CoSimulation &robot) {
    for (std::size_t k = 0; k < count; ++k) values[k] = robot.get(which[k]);
  });
}
EXPORT Status fmi3SetFloat64(Component c, const Reference *which, std::size_t count,
                             const double *values, std::size_t) {
  return call(c, [&](CoSimulation &robot) {
    for (std::size_t k = 0; k < count; ++k) robot.set(which[k], values[k]);
  });
}

EXPORT Status fmi3GetFMUState(Component c, void **state) {
  return call(c, [&](CoSimulation &robot) {
    auto *kept = static_cast<CoSimulation::State *>(*state);
    if (kept)
      *kept = robot.state();
    else
      *state = new CoSimulation::State(robot.state());
  });
}
EXPORT Status fmi3SetFMUState(Component c, void *state) {
  return call(
      c, [&](CoSimulation &robot) { robot.restore(*static_cast<CoSimulation::State *>(state)); });
}
EXPORT Status fmi3FreeFMUState(Component, void **state) {
  delete static_cast<CoSimulation::State *>(*state);
  *state = nullptr;
  return OK;
}

EXPORT Status fmi3DoStep(Component c, double t, double h, bool, bool *event, bool *terminate,
                         bool *early, double *reached) {
  *event = *terminate = *early = false;
  const Status status = call(c, [&](CoSimulation &robot) { *terminate = !robot.step(t, h); });
  *reached = of(c).robot->time();
  if (*terminate) of(c).log(of(c).robot->message());
  return status;
}

// What is not there. Numbers of other types: none is asked for, or it is an error.
#define TYPE(NAME, NUMBER)                                                                       \
  EXPORT Status fmi3Get##NAME(Component c, const Reference *, std::size_t count, NUMBER *,       \
                              std::size_t) {                                                     \
    return count == 0 ? OK : lacking(c, "variables of the type " #NAME);                         \
  }                                                                                              \
  EXPORT Status fmi3Set##NAME(Component c, const Reference *, std::size_t count, const NUMBER *, \
                              std::size_t) {                                                     \
    return count == 0 ? OK : lacking(c, "variables of the type " #NAME);                         \
  }
TYPE(Float32, float)
TYPE(Int8, std::int8_t)
TYPE(UInt8, std::uint8_t)
TYPE(Int16, std::int16_t)
TYPE(UInt16, std::uint16_t)
TYPE(Int32, std::int32_t)
TYPE(UInt32, std::uint32_t)
TYPE(Int64, std::int64_t)
TYPE(UInt64, std::uint64_t)
TYPE(Boolean, bool)
TYPE(String, Text)
#undef TYPE

// Functions whose arguments are of no use here. (The C convention lets a callee ignore them.)
#define NONE(NAME, WHAT) \
  EXPORT Status fmi3##NAME(Component c) { return lacking(c, WHAT); }
NONE(GetBinary, "binary variables")
NONE(SetBinary, "binary variables")
NONE(GetClock, "clocks")
NONE(SetClock, "clocks")
NONE(GetIntervalDecimal, "clocks")
NONE(GetIntervalFraction, "clocks")
NONE(GetShiftDecimal, "clocks")
NONE(GetShiftFraction, "clocks")
NONE(SetIntervalDecimal, "clocks")
NONE(SetIntervalFraction, "clocks")
NONE(SetShiftDecimal, "clocks")
NONE(SetShiftFraction, "clocks")
NONE(ActivateModelPartition, "clocks")
NONE(GetNumberOfVariableDependencies, "variable dependencies")
NONE(GetVariableDependencies, "variable dependencies")
NONE(SerializedFMUStateSize, "serialised states")
NONE(SerializeFMUState, "serialised states")
NONE(DeserializeFMUState, "serialised states")
NONE(GetDirectionalDerivative, "directional derivatives")
NONE(GetAdjointDerivative, "adjoint derivatives")
NONE(GetOutputDerivatives, "derivatives of outputs")
NONE(EnterConfigurationMode, "structural parameters")
NONE(ExitConfigurationMode, "structural parameters")
NONE(EnterEventMode, "events")
NONE(EnterStepMode, "events")
NONE(EvaluateDiscreteStates, "events")
NONE(UpdateDiscreteStates, "events")
NONE(EnterContinuousTimeMode, "model exchange")
NONE(CompletedIntegratorStep, "model exchange")
NONE(SetTime, "model exchange")
NONE(SetContinuousStates, "model exchange")
NONE(GetContinuousStateDerivatives, "model exchange")
NONE(GetEventIndicators, "model exchange")
NONE(GetContinuousStates, "model exchange")
NONE(GetNominalsOfContinuousStates, "model exchange")
NONE(GetNumberOfEventIndicators, "model exchange")
NONE(GetNumberOfContinuousStates, "model exchange")
#undef NONE
