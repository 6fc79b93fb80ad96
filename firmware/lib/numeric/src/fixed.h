// Fixed-point arithmetic for a processor that multiplies 8 by 8 bits: saturating, without 64-bit products or divisions.
#pragma once
#include <stdint.h>

namespace flexura {

constexpr int32_t kMost = INT32_MAX, kLeast = INT32_MIN;

template <class T>
inline T clamp(T value, T least, T most) {
  return value < least ? least : value > most ? most : value;
}

inline int32_t add(int32_t a, int32_t b) {
  const uint32_t sum = static_cast<uint32_t>(a) + static_cast<uint32_t>(b);
  const bool overflow = static_cast<int32_t>((static_cast<uint32_t>(a) ^ sum) & (static_cast<uint32_t>(b) ^ sum)) < 0;
  return overflow ? (a < 0 ? kLeast : kMost) : static_cast<int32_t>(sum);
}

inline int32_t subtract(int32_t a, int32_t b) {
  const uint32_t difference = static_cast<uint32_t>(a) - static_cast<uint32_t>(b);
  const bool overflow =
      static_cast<int32_t>((static_cast<uint32_t>(a) ^ static_cast<uint32_t>(b)) & (static_cast<uint32_t>(a) ^ difference)) < 0;
  return overflow ? (a < 0 ? kLeast : kMost) : static_cast<int32_t>(difference);
}

inline int16_t narrow(int32_t value) { return static_cast<int16_t>(clamp<int32_t>(value, INT16_MIN, INT16_MAX)); }

// A whole number as Q8.
inline int32_t q8(int32_t whole) { return static_cast<int32_t>(static_cast<uint32_t>(whole) * 256u); }

// The halves of a 32-bit product a x b = high 2^16 + low, by two multiplications of 16 bits.
inline int32_t high_part(int32_t a, int16_t b) { return static_cast<int32_t>(static_cast<int16_t>(a >> 16)) * b; }
inline int32_t low_part(int32_t a, int16_t b) { return static_cast<int32_t>(static_cast<uint16_t>(a)) * b; }

// a x b, saturated.
inline int32_t multiply(int32_t a, int16_t b) {
  const int32_t low = low_part(a, b), top = high_part(a, b) + (low >> 16);
  if (top > INT16_MAX) return kMost;
  if (top < INT16_MIN) return kLeast;
  return static_cast<int32_t>(static_cast<uint32_t>(top) << 16 | static_cast<uint16_t>(low));
}

// a x b / 2^15, for a factor b in [-1, 1) as Q15; rounded down.
inline int32_t fraction(int32_t a, int16_t b) {
  return static_cast<int32_t>((static_cast<uint32_t>(high_part(a, b)) << 1) + static_cast<uint32_t>(low_part(a, b) >> 15));
}

// value x scale as an integer; false when it is not finite or needs more than 32 bits. Not for the control interrupt.
inline bool to_fixed(float value, float scale, int32_t &fixed) {
  const float scaled = value * scale;
  if (!(scaled > -2147483000.0f && scaled < 2147483000.0f)) return false;
  fixed = static_cast<int32_t>(scaled + (scaled < 0 ? -0.5f : 0.5f));
  return true;
}

}  // namespace flexura
