// What the core refuses: a link (from 0; -1: the whole robot), the quantity, and a sentence that
// says what was expected.
#pragma once
#include <stdexcept>
#include <string>

namespace flexura {

struct Fault : std::runtime_error {
  int link;
  std::string key;
  Fault(int link_, std::string key_, const std::string &expected)
      : std::runtime_error(expected), link(link_), key(std::move(key_)) {}
};

}  // namespace flexura
