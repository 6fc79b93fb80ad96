// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Saturating fixed-point arithmetic without 64-bit products and without divisions.
//
// The processor multiplies 8 by 8 bits and shifts by one bit.
#pragma once
#include <stdint.h>

namespace flexura {

constexpr int32_t kInt32Max = INT32_MAX, kInt32Min = INT32_MIN;

template <class T>
inline T clamp(T value, T least, T most) {
  return value < least ? least : value > most ? most : value;
}

inline int32_t add(int32_t a, int32_t b) {
  const uint32_t sum = static_cast<uint32_t>(a) + static_cast<uint32_t>(b);
  const bool overflow =
      static_cast<int32_t>((static_cast<uint32_t>(a) ^ sum) & (static_cast<uint32_t>(b) ^ sum)) < 0;
  return overflow ? (a < 0 ? kInt32Min : kInt32Max) : static_cast<int32_t>(sum);
}

inline int32_t subtract(int32_t a, int32_t b) {
  const uint32_t difference = static_cast<uint32_t>(a) - static_cast<uint32_t>(b);
  const bool overflow = static_cast<int32_t>((static_cast<uint32_t>(a) ^ static_cast<uint32_t>(b)) &
                                             (static_cast<uint32_t>(a) ^ difference)) < 0;
  return overflow ? (a < 0 ? kInt32Min : kInt32Max) : static_cast<int32_t>(difference);
}

inline int16_t saturate16(int32_t value) {
  return static_cast<int16_t>(clamp<int32_t>(value, INT16_MIN, INT16_MAX));
}

// A whole number as Q8.
inline int32_t to_q8(int32_t whole) {
  return static_cast<int32_t>(static_cast<uint32_t>(whole) * 256u);
}

inline int16_t upper(int32_t a) { return static_cast<int16_t>(static_cast<uint32_t>(a) >> 16); }
inline uint16_t lower(int32_t a) { return static_cast<uint16_t>(a); }

// The whole number next to a Q16, halves up. |a| < 2^31 - 2^15.
inline int16_t nearest(int32_t a) { return upper(a + 0x8000L); }

// 16 x 16 = 32 bits. GCC multiplies 32 by 32 bits here, which takes three times as long. The C++
// expression after #else is the specification; the unit tests run on both versions.
#ifdef __AVR__

inline int32_t signed_product(int16_t a, int16_t b) {
  int32_t result;
  __asm__(
      "muls %B1, %B2   \n\t"  // high x high
      "movw %C0, r0    \n\t"
      "mul %A1, %A2    \n\t"  // low x low
      "movw %A0, r0    \n\t"
      "mulsu %B1, %A2  \n\t"  // high of a x low of b, with its sign
      "sbc %D0, %3     \n\t"
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "mulsu %B2, %A1  \n\t"  // high of b x low of a, with its sign
      "sbc %D0, %3     \n\t"
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "clr r1          \n\t"  // the compiler expects 0 there
      : "=&r"(result)
      : "a"(a), "a"(b), "r"(static_cast<uint8_t>(0))
      : "r0");
  return result;
}

inline int32_t mixed_product(uint16_t a, int16_t b) {
  int32_t result;
  __asm__(
      "mulsu %B2, %B1  \n\t"  // high x high; b has the sign
      "movw %C0, r0    \n\t"
      "mul %A1, %A2    \n\t"  // low x low
      "movw %A0, r0    \n\t"
      "mulsu %B2, %A1  \n\t"  // high of b x low of a, with its sign
      "sbc %D0, %3     \n\t"
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "mul %B1, %A2    \n\t"  // high of a x low of b
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "clr r1          \n\t"  // the compiler expects 0 there
      : "=&r"(result)
      : "a"(a), "a"(b), "r"(static_cast<uint8_t>(0))
      : "r0");
  return result;
}

inline uint32_t unsigned_product(uint16_t a, uint16_t b) {
  uint32_t result;
  __asm__(
      "mul %B1, %B2    \n\t"  // high x high
      "movw %C0, r0    \n\t"
      "mul %A1, %A2    \n\t"  // low x low
      "movw %A0, r0    \n\t"
      "mul %B1, %A2    \n\t"  // high of a x low of b
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "mul %A1, %B2    \n\t"  // low of a x high of b
      "add %B0, r0     \n\t"
      "adc %C0, r1     \n\t"
      "adc %D0, %3     \n\t"
      "clr r1          \n\t"  // the compiler expects 0 there
      : "=&r"(result)
      : "r"(a), "r"(b), "r"(static_cast<uint8_t>(0))
      : "r0");
  return result;
}

#else

inline int32_t signed_product(int16_t a, int16_t b) { return static_cast<int32_t>(a) * b; }
inline int32_t mixed_product(uint16_t a, int16_t b) { return static_cast<int32_t>(a) * b; }
inline uint32_t unsigned_product(uint16_t a, uint16_t b) { return static_cast<uint32_t>(a) * b; }

#endif

// a x b, saturated.
inline int32_t multiply(int32_t a, int16_t b) {
  const int32_t low = mixed_product(lower(a), b);
  const int32_t top = signed_product(upper(a), b) + upper(low);
  if (top != static_cast<int16_t>(top)) return top < 0 ? kInt32Min : kInt32Max;
  return static_cast<int32_t>(static_cast<uint32_t>(top) << 16 | lower(low));
}

// A sum of products, 48 bits wide. Products of 24 by 16 bits need 39 bits, of 32 by 16 bits 47.
//
// All controllers compute with it. On the host `sum_` has 64 bits: that is the specification. On
// the AVR the same sum is kept in `low_` (32 bits) and `high_` (16 bits).
#ifdef __AVR__

class Accumulator48 {
 public:
  explicit Accumulator48(int32_t value = 0)
      : low_(static_cast<uint32_t>(value)), high_(value < 0 ? -1 : 0) {}

  // Adds a x b for |a| < 2^23. C++: sum_ += static_cast<int64_t>(a) * b
  void add(int32_t a, int16_t b) {
    uint32_t t;  // bytes 0 to 3 of the product
    uint8_t t4;  // its byte 4
    __asm__(
        "mul %A4, %A5    \n\t"  // a0 x b0 -> bytes 0, 1
        "movw %A2, r0    \n\t"
        "mulsu %7, %A5  \n\t"  // a2 x b0, signed -> bytes 2, 3
        "movw %C2, r0    \n\t"
        "sbc %3, %3      \n\t"  // its sign -> byte 4
        "muls %7, %B5   \n\t"   // a2 x b1, signed -> bytes 3, 4
        "add %D2, r0     \n\t"
        "adc %3, r1      \n\t"
        "mul %B4, %A5    \n\t"  // a1 x b0 -> bytes 1, 2
        "add %B2, r0     \n\t"
        "adc %C2, r1     \n\t"
        "adc %D2, %6     \n\t"
        "adc %3, %6      \n\t"
        "mulsu %B5, %A4  \n\t"  // a0 x b1, signed -> bytes 1, 2
        "sbc %D2, %6     \n\t"  // its sign
        "sbc %3, %6      \n\t"
        "add %B2, r0     \n\t"
        "adc %C2, r1     \n\t"
        "adc %D2, %6     \n\t"
        "adc %3, %6      \n\t"
        "mulsu %B5, %B4  \n\t"  // a1 x b1, signed -> bytes 2, 3
        "sbc %3, %6      \n\t"  // its sign
        "add %C2, r0     \n\t"
        "adc %D2, r1     \n\t"
        "adc %3, %6      \n\t"
        "clr r1          \n\t"  // the compiler expects 0 there
        "mov r0, %3      \n\t"  // the product's sign -> byte 5
        "lsl r0          \n\t"
        "sbc r0, r0      \n\t"
        "add %A0, %A2    \n\t"  // 48-bit sum += product
        "adc %B0, %B2    \n\t"
        "adc %C0, %C2    \n\t"
        "adc %D0, %D2    \n\t"
        "adc %A1, %3     \n\t"
        "adc %B1, r0     \n\t"
        : "+l"(low_), "+l"(high_), "=&l"(t), "=&l"(t4)
        : "a"(lower(a)), "a"(b), "r"(static_cast<uint8_t>(0)), "a"(static_cast<int8_t>(a >> 16))
        : "r0");
  }

  // Adds a x b for any a. C++: sum_ += static_cast<int64_t>(a) * b
  void add_scaled(int32_t a, int16_t b) {
    const int32_t low = mixed_product(lower(a), b);
    const int32_t high = signed_product(upper(a), b);
    __asm__(
        "mov r0, %D2   \n\t"  // the sign of low -> bytes 4, 5
        "lsl r0        \n\t"
        "sbc r0, r0    \n\t"
        "add %A0, %A2  \n\t"  // 48-bit sum += low
        "adc %B0, %B2  \n\t"
        "adc %C0, %C2  \n\t"
        "adc %D0, %D2  \n\t"
        "adc %A1, r0   \n\t"
        "adc %B1, r0   \n\t"
        "add %C0, %A3  \n\t"  // 48-bit sum += high x 2^16
        "adc %D0, %B3  \n\t"
        "adc %A1, %C3  \n\t"
        "adc %B1, %D3  \n\t"
        : "+r"(low_), "+r"(high_)
        : "r"(low), "r"(high)
        : "r0");
  }

  void add(int32_t value) {
    const uint32_t before = low_;
    low_ += static_cast<uint32_t>(value);
    high_ = static_cast<int16_t>(high_ + (value < 0 ? -1 : 0) + (low_ < before));
  }

  // The sum, saturated.
  int32_t value() const {
    if (high_ == 0 && static_cast<int32_t>(low_) >= 0) return static_cast<int32_t>(low_);
    if (high_ == -1 && static_cast<int32_t>(low_) < 0) return static_cast<int32_t>(low_);
    return high_ < 0 ? kInt32Min : kInt32Max;
  }

  // The sum / 2^32, rounded down.
  int16_t high_word() const { return high_; }

  // The sum / 2^16, rounded down.
  int32_t integer_part() const {
    return static_cast<int32_t>(low_ >> 16 | static_cast<uint32_t>(high_) << 16);
  }

 private:
  uint32_t low_;
  int16_t high_;
};

#else

class Accumulator48 {
 public:
  explicit Accumulator48(int32_t value = 0) : sum_(value) {}
  void add(int32_t a, int16_t b) { sum_ += static_cast<int64_t>(a) * b; }
  void add_scaled(int32_t a, int16_t b) { sum_ += static_cast<int64_t>(a) * b; }
  void add(int32_t value) { sum_ += value; }
  int32_t value() const { return static_cast<int32_t>(clamp<int64_t>(sum_, kInt32Min, kInt32Max)); }
  int16_t high_word() const { return static_cast<int16_t>(sum_ >> 32); }
  int32_t integer_part() const { return static_cast<int32_t>(sum_ >> 16); }

 private:
  int64_t sum_;
};

#endif

// a x b / 2^16, rounded down. Only whole bytes are shifted: the processor shifts by one bit at a
// time.
inline int32_t multiply_high(int32_t a, int16_t b) {
  return signed_product(upper(a), b) + upper(mixed_product(lower(a), b));
}

// The same for a factor b in [0, 1) as Q16.
inline int32_t multiply_q16(int32_t a, uint16_t b) {
  return mixed_product(b, upper(a)) + static_cast<int32_t>(unsigned_product(lower(a), b) >> 16);
}

// value x scale as an integer; false when it is not finite or needs more than 32 bits. Not for the
// control interrupt.
inline bool to_fixed(float value, float scale, int32_t &fixed) {
  const float scaled = value * scale;
  if (!(scaled > -2147483000.0f && scaled < 2147483000.0f)) return false;
  fixed = static_cast<int32_t>(scaled + (scaled < 0 ? -0.5f : 0.5f));
  return true;
}

}  // namespace flexura
