// One instance of an FMU, whatever the version of FMI: its robot, and how errors reach the log.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "fmi/co_simulation.hpp"

namespace flexura {

bool processor_suffices();  // processor.cpp: whether the core inside runs here
constexpr const char *OLD_PROCESSOR =
    "the FMU was made for processors of the level x86-64-v3; this is an older one";

struct Instance {
  std::function<void(const std::string &)> log;  // an error
  RobotFile file;
  std::unique_ptr<CoSimulation> robot;

  // Calls f with the robot; false: it has thrown, and the log says what.
  template <class Function>
  bool good(Function f) {
    try {
      f(*robot);
      return true;
    } catch (const std::exception &error) {
      log(error.what());
      return false;
    }
  }
};

// An instance of the robot in a folder of resources, a path or a file URI. Null: there is none, or
// the model description, whose token is given, is another robot's; the log says so.
std::unique_ptr<Instance> make_instance(const char *resources, const char *token,
                                        std::function<void(const std::string &)> log);

}  // namespace flexura
