#include "fmi/instance.hpp"

#include <stdexcept>

#include "robot/input_fault.hpp"

namespace flexura {
namespace {

int digit(char c) {
  return '0' <= c && c <= '9'                 ? c - '0'
         : 'a' <= (c | 32) && (c | 32) <= 'f' ? (c | 32) - 'a' + 10
                                              : -1;
}

// A path from a path or a URI, file:/a, file:///a or file://localhost/a, with its %20.
std::string path_of(const std::string &given) {
  if (given.compare(0, 5, "file:") != 0) return given;
  std::string rest = given.substr(5), out;
  if (rest.compare(0, 2, "//") == 0) {
    const std::size_t end = rest.find('/', 2);
    rest = end == std::string::npos ? "" : rest.substr(end);
  }
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const bool coded =
        rest[k] == '%' && k + 2 < rest.size() && digit(rest[k + 1]) >= 0 && digit(rest[k + 2]) >= 0;
    out += coded ? char(16 * digit(rest[k + 1]) + digit(rest[k + 2])) : rest[k];
    if (coded) k += 2;
  }
  return out;
}

}  // namespace

std::unique_ptr<Instance> make_instance(const char *resources, const char *token,
                                        std::function<void(const std::string &)> log) {
  auto made = std::make_unique<Instance>();
  made->log = std::move(log);
  try {
    if (resources == nullptr || token == nullptr)
      throw std::invalid_argument("the environment names no folder of resources or no token");
    std::string folder = path_of(resources);
    if (!folder.empty() && folder.back() != '/') folder += '/';
    made->file = read_robot_file(folder + "robot.bin");
    if (made->file.token != token)
      throw std::runtime_error("the model description is that of another robot: token " +
                               std::string(token) + ", expected " + made->file.token);
    made->robot = std::make_unique<CoSimulation>(made->file);
  } catch (const std::exception &error) {
    made->log(error.what());
    return nullptr;
  }
  return made;
}

}  // namespace flexura
