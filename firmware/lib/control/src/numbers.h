// The two kinds of numbers that the control law is computed with: the board's integers, and the model's doubles.
#pragma once
#include "fixed.h"

namespace flexura {

// Integers, scaled as PidGains says.
struct BoardNumbers {
  using Gain = int32_t;    // of Sum::add
  using Value = int16_t;   // outputs, rates
  using Wide = int32_t;    // errors, sums
  using Sum = flexura::Sum;
  static Value error(Wide e, bool fine) { return fine ? narrow(e >> 4) : narrow(e >> 8); }
  static Value difference(Value a, Value b) { return narrow(static_cast<int32_t>(a) - b); }
  static Value narrowed(Wide x) { return narrow(x); }
  static bool outside(const Sum &sum, Value limit) { return sum.top() >= limit || sum.top() < -limit; }
};

#ifndef __AVR__
// SI units; infinite limits are allowed.
struct ModelNumbers {
  using Gain = double;
  using Value = double;
  using Wide = double;
  struct Sum {
    double sum;
    explicit Sum(double value = 0.0) : sum(value) {}
    void add(double a, double b) { sum += a * b; }
    void add_long(double a, double b) { sum += a * b; }
    void add(double value) { sum += value; }
    double whole() const { return sum; }
  };
  static double error(double e, bool) { return e; }
  static double difference(double a, double b) { return a - b; }
  static double narrowed(double x) { return x; }
  static bool outside(const Sum &sum, double limit) { return !(-limit <= sum.sum && sum.sum <= limit); }
};
#endif

}  // namespace flexura
