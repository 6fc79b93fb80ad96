// The checks of the core's C++ tests. A test file is one program:
//
//     #include "check.hpp"
//     TEST("what must hold") { CHECK(1 + 1 == 2); CHECK_NEAR(0.1 + 0.2, 0.3, 1e-15); }
//
// It runs every test, prints what failed with its place, and ends with status 1 if anything did. A
// word on the command line chooses the tests whose names contain it. CHECK_NEAR: the difference is
// at most the third number; not a number fails.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <vector>

namespace check {

struct Test {
  const char *name;
  void (*run)();
};
inline std::vector<Test> &tests() {
  static std::vector<Test> all;
  return all;
}
inline int &failures() {
  static int count = 0;
  return count;
}
struct Entry {
  Entry(const char *name, void (*run)()) { tests().push_back({name, run}); }
};

inline void failed(const char *file, int line, const char *text) {
  if (++failures() <= 50) std::printf("%s:%d: %s\n", file, line, text);
}
inline void that(bool holds, const char *file, int line, const char *text) {
  if (!holds) failed(file, line, text);
}
inline void near(double a, double b, double most, const char *file, int line, const char *text) {
  if (std::fabs(a - b) <= most) return;
  failed(file, line, text);
  if (failures() <= 50)
    std::printf("    %.17g and %.17g differ by %.3g, more than %.3g\n", a, b, std::fabs(a - b),
                most);
}

// Random numbers that are the same everywhere (the standard's distributions are not): x_k =
// 6364136223846793005 x_{k-1} + 1.
struct Random {
  std::uint64_t state = 1;
  double operator()(double from, double to) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * static_cast<double>(state >> 11) * 0x1p-53;
  }
};

// One number for the bits of many: whether a build, a compiler or a machine gives the same digits.
// All that is not a number is one.
struct Digest {
  std::uint64_t value = 0xcbf29ce484222325u;
  void add(double x) {
    std::uint64_t bits = 0x7ff8000000000000u;
    if (x == x) std::memcpy(&bits, &x, sizeof bits);
    for (int k = 0; k < 8; ++k) value = (value ^ (bits >> 8 * k & 255u)) * 0x100000001b3u;
  }
};

inline bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (a != a && b != b);
}

inline int run(int argc, char **argv) {
  int count = 0;
  for (const Test &test : tests()) {
    if (argc > 1 && !std::strstr(test.name, argv[1])) continue;
    const int before = failures();
    ++count;
    try {
      test.run();
    } catch (const std::exception &error) {
      failed("an exception", 0, error.what());
    }
    std::printf("%s  %s\n", failures() == before ? "ok    " : "FAILED", test.name);
  }
  if (count == 0) std::printf("no such test\n");
  return failures() == 0 && count > 0 ? 0 : 1;
}

}  // namespace check

#define CHECK_JOIN_(a, b) a##b
#define CHECK_JOIN(a, b) CHECK_JOIN_(a, b)
#define TEST(name)                                                                           \
  static void CHECK_JOIN(test_, __LINE__)();                                                 \
  static const check::Entry CHECK_JOIN(entry_, __LINE__)(name, CHECK_JOIN(test_, __LINE__)); \
  static void CHECK_JOIN(test_, __LINE__)()
#define CHECK(...) check::that(static_cast<bool>(__VA_ARGS__), __FILE__, __LINE__, #__VA_ARGS__)
#define CHECK_NEAR(a, b, most) check::near(a, b, most, __FILE__, __LINE__, #a " near " #b)

int main(int argc, char **argv) { return check::run(argc, argv); }
