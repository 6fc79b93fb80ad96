// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The two kinds of numbers of the control law: the board's integers and the model's doubles.
#pragma once
#include "fixed.h"

namespace flexura {

// Integers, scaled as PidGains says.
struct BoardNumbers {
  using Gain = int32_t;     // of Accumulator48::add
  using Value = int16_t;    // outputs, rates
  using Wide = int32_t;     // errors, sums
  using Factor = uint16_t;  // of a filter, Q16
  using Accumulator = Accumulator48;
  static Value error(Wide e, bool fine) { return fine ? saturate16(e >> 4) : saturate16(e >> 8); }
  static Value difference(Value a, Value b) { return saturate16(static_cast<int32_t>(a) - b); }
  static Value saturated(Wide x) { return saturate16(x); }
  static Wide widened(Value u) { return static_cast<int32_t>(u) * 65536; }
  static Wide product(Gain a, Value b) { return multiply(a, b); }
  static Wide plus(Wide a, Wide b) { return add(a, b); }
  static Wide less(Wide a, Wide b) { return subtract(a, b); }
  static Wide filtered(Wide before, Wide x, Factor a) {
    return add(before, multiply_q16(subtract(x, before), a));
  }
  static bool outside(const Accumulator &sum, Value limit) {
    return sum.high_word() >= limit || sum.high_word() < -limit;
  }
};

#ifndef __AVR__
// SI units; infinite limits are allowed.
struct ModelNumbers {
  using Gain = double;
  using Value = double;
  using Wide = double;
  using Factor = double;
  struct Accumulator {
    double sum;
    explicit Accumulator(double value = 0.0) : sum(value) {}
    void add(double a, double b) { sum += a * b; }
    void add_scaled(double a, double b) { sum += a * b; }
    void add(double value) { sum += value; }
    double integer_part() const { return sum; }
  };
  static double error(double e, bool) { return e; }
  static double difference(double a, double b) { return a - b; }
  static double saturated(double x) { return x; }
  static double widened(double u) { return u; }
  static double product(double a, double b) { return a * b; }
  static double plus(double a, double b) { return a + b; }
  static double less(double a, double b) { return a - b; }
  static double filtered(double before, double x, double a) { return before + a * (x - before); }
  static bool outside(const Accumulator &sum, double limit) {
    return !(-limit <= sum.sum && sum.sum <= limit);
  }
};
#endif

}  // namespace flexura
