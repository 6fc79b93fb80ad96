// The functions of FMI 2.0 for co-simulation (Functional Mock-up Interface for Model Exchange and
// Co-Simulation, 2.0.5, chapters 2.1 and 4.2), declared here as the standard says.
#include <cstddef>

#include "fmi/instance.hpp"

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using flexura::CoSimulation;
using flexura::Instance;

using Component = void *;
using Reference = unsigned;
using Boolean = int;
using Text = const char *;
enum Status { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };
enum Kind { DO_STEP_STATUS, PENDING_STATUS, LAST_SUCCESSFUL_TIME, TERMINATED };
enum Type { MODEL_EXCHANGE, CO_SIMULATION };

struct Callbacks {
  void (*logger)(void *environment, Text instance, Status status, Text category, Text message, ...);
  void *(*allocate)(std::size_t count, std::size_t size);
  void (*release)(void *memory);
  void (*step_finished)(void *environment, Status status);
  void *environment;
};

// With what the last step came to.
struct Slave {
  std::unique_ptr<Instance> instance;
  bool at_limit = false;
};

Instance &of(Component c) { return *static_cast<Slave *>(c)->instance; }

template <class Function>
Status call(Component c, Function f) {
  return of(c).good(f) ? OK : ERROR;
}

Status lacking(Component c, Text what) {
  of(c).log(std::string("the FMU has no ") + what);
  return ERROR;
}

}  // namespace

EXPORT Text fmi2GetTypesPlatform() { return "default"; }
EXPORT Text fmi2GetVersion() { return "2.0"; }
EXPORT Status fmi2SetDebugLogging(Component, Boolean, std::size_t, const Text *) { return OK; }

EXPORT Component fmi2Instantiate(Text name, Type type, Text guid, Text resources,
                                 const Callbacks *callbacks, Boolean, Boolean) {
  const Callbacks by = *callbacks;
  if (!flexura::processor_suffices()) {
    if (by.logger) by.logger(by.environment, name, ERROR, "logStatusError", flexura::OLD_PROCESSOR);
    return nullptr;
  }
  // The message is a format of printf; loggers of some languages see nothing else.
  auto log = [by, name = std::string(name ? name : "")](const std::string &text) {
    std::string format;
    for (const char c : text) format += c == '%' ? "%%" : std::string(1, c);
    if (by.logger) by.logger(by.environment, name.c_str(), ERROR, "logStatusError", format.c_str());
  };
  if (type != CO_SIMULATION) {
    log("the FMU is for co-simulation only");
    return nullptr;
  }
  auto instance = flexura::make_instance(resources, guid, log);
  return instance ? new Slave{std::move(instance)} : nullptr;
}
EXPORT void fmi2FreeInstance(Component c) { delete static_cast<Slave *>(c); }

EXPORT Status fmi2SetupExperiment(Component c, Boolean tolerance_defined, double tolerance,
                                  double start, Boolean stop_defined, double stop) {
  return call(c, [&](CoSimulation &robot) {
    if (tolerance_defined) robot.set_tolerance(tolerance);
    robot.schedule(start, stop_defined ? stop : std::numeric_limits<double>::infinity());
  });
}
EXPORT Status fmi2EnterInitializationMode(Component) { return OK; }
EXPORT Status fmi2ExitInitializationMode(Component c) {
  return call(c, [](CoSimulation &robot) { robot.start(); });
}
EXPORT Status fmi2Terminate(Component) { return OK; }
EXPORT Status fmi2Reset(Component c) {
  Instance &instance = of(c);
  static_cast<Slave *>(c)->at_limit = false;
  return call(
      c, [&](CoSimulation &) { instance.robot = std::make_unique<CoSimulation>(instance.file); });
}

EXPORT Status fmi2GetReal(Component c, const Reference *which, std::size_t count, double *values) {
  return call(c, [&](CoSimulation &robot) {
    for (std::size_t k = 0; k < count; ++k) values[k] = robot.get(which[k]);
  });
}
EXPORT Status fmi2SetReal(Component c, const Reference *which, std::size_t count,
                          const double *values) {
  return call(c, [&](CoSimulation &robot) {
    for (std::size_t k = 0; k < count; ++k) robot.set(which[k], values[k]);
  });
}
EXPORT Status fmi2GetInteger(Component c, const Reference *, std::size_t count, int *) {
  return count == 0 ? OK : lacking(c, "whole numbers");
}
EXPORT Status fmi2SetInteger(Component c, const Reference *, std::size_t count, const int *) {
  return count == 0 ? OK : lacking(c, "whole numbers");
}
EXPORT Status fmi2GetBoolean(Component c, const Reference *, std::size_t count, Boolean *) {
  return count == 0 ? OK : lacking(c, "booleans");
}
EXPORT Status fmi2SetBoolean(Component c, const Reference *, std::size_t count, const Boolean *) {
  return count == 0 ? OK : lacking(c, "booleans");
}
EXPORT Status fmi2GetString(Component c, const Reference *, std::size_t count, Text *) {
  return count == 0 ? OK : lacking(c, "texts");
}
EXPORT Status fmi2SetString(Component c, const Reference *, std::size_t count, const Text *) {
  return count == 0 ? OK : lacking(c, "texts");
}

EXPORT Status fmi2GetFMUstate(Component c, void **state) {
  return call(c, [&](CoSimulation &robot) {
    auto *kept = static_cast<CoSimulation::State *>(*state);
    if (kept)
      *kept = robot.state();
    else
      *state = new CoSimulation::State(robot.state());
  });
}
EXPORT Status fmi2SetFMUstate(Component c, void *state) {
  static_cast<Slave *>(c)->at_limit = false;
  return call(
      c, [&](CoSimulation &robot) { robot.restore(*static_cast<CoSimulation::State *>(state)); });
}
EXPORT Status fmi2FreeFMUstate(Component, void **state) {
  delete static_cast<CoSimulation::State *>(*state);
  *state = nullptr;
  return OK;
}
EXPORT Status fmi2SerializedFMUstateSize(Component c, void *, std::size_t *) {
  return lacking(c, "serialised states");
}
EXPORT Status fmi2SerializeFMUstate(Component c, void *, char *, std::size_t) {
  return lacking(c, "serialised states");
}
EXPORT Status fmi2DeSerializeFMUstate(Component c, const char *, std::size_t, void **) {
  return lacking(c, "serialised states");
}
EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference *, std::size_t,
                                           const Reference *, std::size_t, const double *,
                                           double *) {
  return lacking(c, "directional derivatives");
}

EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference *which, std::size_t count,
                                          const int *order, const double *values) {
  return call(c, [&](CoSimulation &robot) {
    for (std::size_t k = 0; k < count; ++k) robot.set_derivative(which[k], order[k], values[k]);
  });
}
EXPORT Status fmi2GetRealOutputDerivatives(Component c, const Reference *, std::size_t, const int *,
                                           double *) {
  return lacking(c, "derivatives of outputs");
}
EXPORT Status fmi2DoStep(Component c, double t, double h, Boolean) {
  Slave &slave = *static_cast<Slave *>(c);
  bool went = false;
  const Status status = call(c, [&](CoSimulation &robot) { went = robot.step(t, h); });
  if (status != OK || went) return status;
  slave.at_limit = true;
  slave.instance->log(slave.instance->robot->message());
  return DISCARD;
}
EXPORT Status fmi2CancelStep(Component c) { return lacking(c, "steps in the background"); }
EXPORT Status fmi2GetStatus(Component c, Kind, Status *) {
  return lacking(c, "steps in the background");
}
EXPORT Status fmi2GetRealStatus(Component c, Kind kind, double *value) {
  if (kind != LAST_SUCCESSFUL_TIME) return lacking(c, "such status");
  *value = of(c).robot->time();
  return OK;
}
EXPORT Status fmi2GetIntegerStatus(Component c, Kind, int *) { return lacking(c, "such status"); }
EXPORT Status fmi2GetBooleanStatus(Component c, Kind kind, Boolean *value) {
  if (kind != TERMINATED) return lacking(c, "such status");
  *value = static_cast<Slave *>(c)->at_limit;
  return OK;
}
EXPORT Status fmi2GetStringStatus(Component c, Kind, Text *) { return lacking(c, "such status"); }
