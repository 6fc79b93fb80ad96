#include "fmi/robot_file.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "robot/robot_table.hpp"

namespace flexura {
namespace {

// Numbers of eight bytes, one after the other.
class Reader {
 public:
  Reader(std::string bytes, std::string path) : bytes_(std::move(bytes)), path_(std::move(path)) {}

  template <class Number>
  std::vector<Number> take(std::size_t count) {
    static_assert(sizeof(Number) == 8, "numbers of eight bytes");
    expect(count <= (bytes_.size() - at_) / 8, "it ends early");
    std::vector<Number> out(count);
    if (count > 0) std::memcpy(out.data(), bytes_.data() + at_, 8 * count);
    at_ += 8 * count;
    return out;
  }
  std::string text(std::size_t size) {
    const std::size_t room = (size + 7) / 8 * 8;
    expect(room >= size && room <= bytes_.size() - at_, "it ends early");
    std::string out = bytes_.substr(at_, size);
    at_ += room;
    return out;
  }
  void expect(bool good, const char *what) const {
    if (!good) throw std::runtime_error(path_ + " is no robot of this library: " + what);
  }
  bool over() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_, path_;
  std::size_t at_ = 0;
};

}  // namespace

RobotFile read_robot_file(const std::string &path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + " cannot be read");
  Reader file(std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()),
              path);
  file.expect(file.text(8) == "flexura1", "its first word is not flexura1");
  const std::vector<std::int64_t> head = file.take<std::int64_t>(9);
  for (std::int64_t count : head)
    file.expect(0 <= count && count < 1000000, "a count in its head is absurd");
  RobotFile out;
  out.token = file.text(std::size_t(head[0]));
  const std::size_t links = std::size_t(head[1]), sensors = std::size_t(head[5]);
  file.expect(links > 0, "it has no links");
  Table table;
  table.links = int(head[1]), table.intervals = int(head[2]), table.lumps = int(head[3]);
  out.unknowns = int(head[4]), out.stations = int(head[6]), out.in_equilibrium = head[7] != 0;
  const auto counts = file.take<std::int64_t>(links * COUNTS);
  const auto numbers = file.take<double>(links * NUMBERS);
  const auto material = file.take<double>(std::size_t(head[2]) * MATERIAL);
  const auto lumps = file.take<double>(std::size_t(head[3]) * LUMP);
  const auto gravity = file.take<double>(2), payload = file.take<double>(PAYLOAD);
  table.counts = counts.data(), table.numbers = numbers.data(), table.material = material.data(),
  table.lump = lumps.data(), table.gravity = gravity.data(), table.payload = payload.data();
  out.robot = robot_of(table, 0);
  out.limits = file.take<double>(2 * links);
  out.rtol = file.take<double>(1)[0];
  for (std::size_t k = 0; k < sensors; ++k) {
    const auto row = file.take<double>(3);
    LinkSensor sensor{row[0] != 0.0, int(row[1]), row[2],
                      file.take<double>(std::size_t(out.unknowns))};
    file.expect(0 <= sensor.link && sensor.link < int(links), "a sensor is on no link");
    out.sensors.push_back(std::move(sensor));
  }
  file.expect(file.over(), "it has more bytes than it counts");
  return out;
}

}  // namespace flexura
