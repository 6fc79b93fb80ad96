// Fixed-point arithmetic for a processor that multiplies 8 by 8 bits and shifts by one: saturating, no 64-bit products, no divisions.
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

inline int16_t upper(int32_t a) { return static_cast<int16_t>(static_cast<uint32_t>(a) >> 16); }
inline uint16_t lower(int32_t a) { return static_cast<uint16_t>(a); }

// 16 x 16 = 32 bits. Left to itself GCC multiplies 32 by 32 here, at three times the price; the same tests run on both versions.
#ifdef __AVR__
#define FLEXURA_ADD_PRODUCT " add %B0, r0 \n adc %C0, r1 \n adc %D0, %3 \n"
#define FLEXURA_PRODUCT(Type, text, kind, a, b)                                                                            \
  Type result;                                                                                                            \
  __asm__(text " clr r1" : "=&r"(result) : kind(a), kind(b), "r"(static_cast<uint8_t>(0)) : "r0");                        \
  return result
#else
#define FLEXURA_PRODUCT(Type, text, kind, a, b) return static_cast<Type>(a) * b
#endif

inline int32_t signed_product(int16_t a, int16_t b) {
  FLEXURA_PRODUCT(int32_t,
                  " muls %B1, %B2 \n movw %C0, r0 \n mul %A1, %A2 \n movw %A0, r0 \n"
                  " mulsu %B1, %A2 \n sbc %D0, %3 \n" FLEXURA_ADD_PRODUCT
                  " mulsu %B2, %A1 \n sbc %D0, %3 \n" FLEXURA_ADD_PRODUCT,
                  "a", a, b);
}

inline int32_t mixed_product(uint16_t a, int16_t b) {
  FLEXURA_PRODUCT(int32_t,
                  " mulsu %B2, %B1 \n movw %C0, r0 \n mul %A1, %A2 \n movw %A0, r0 \n"
                  " mulsu %B2, %A1 \n sbc %D0, %3 \n" FLEXURA_ADD_PRODUCT
                  " mul %B1, %A2 \n" FLEXURA_ADD_PRODUCT,
                  "a", a, b);
}

inline uint32_t unsigned_product(uint16_t a, uint16_t b) {
  FLEXURA_PRODUCT(uint32_t,
                  " mul %B1, %B2 \n movw %C0, r0 \n mul %A1, %A2 \n movw %A0, r0 \n"
                  " mul %B1, %A2 \n" FLEXURA_ADD_PRODUCT
                  " mul %A1, %B2 \n" FLEXURA_ADD_PRODUCT,
                  "r", a, b);
}
#undef FLEXURA_PRODUCT
#undef FLEXURA_ADD_PRODUCT

// a x b, saturated.
inline int32_t multiply(int32_t a, int16_t b) {
  const int32_t low = mixed_product(lower(a), b), top = signed_product(upper(a), b) + upper(low);
  if (top != static_cast<int16_t>(top)) return top < 0 ? kLeast : kMost;
  return static_cast<int32_t>(static_cast<uint32_t>(top) << 16 | lower(low));
}

// Sum of products, 48 bits wide: those of 24 by 16 bits need 39, of 32 by 16 bits 47. The arithmetic of all controllers.
class Sum {
 public:
  explicit Sum(int32_t value = 0) {
#ifdef __AVR__
    low_ = static_cast<uint32_t>(value);
    high_ = value < 0 ? -1 : 0;
#else
    sum_ = value;
#endif
  }

  // a x b for |a| < 2^23.
  void add(int32_t a, int16_t b) {
#ifdef __AVR__
    uint32_t t;
    uint8_t t4;
    __asm__(
        " mul %A4, %A5 \n movw %A2, r0 \n"
        " mulsu %C4, %A5 \n movw %C2, r0 \n sbc %3, %3 \n"
        " muls %C4, %B5 \n add %D2, r0 \n adc %3, r1 \n"
        " mul %B4, %A5 \n add %B2, r0 \n adc %C2, r1 \n adc %D2, %6 \n adc %3, %6 \n"
        " mulsu %B5, %A4 \n sbc %D2, %6 \n sbc %3, %6 \n add %B2, r0 \n adc %C2, r1 \n adc %D2, %6 \n adc %3, %6 \n"
        " mulsu %B5, %B4 \n sbc %3, %6 \n add %C2, r0 \n adc %D2, r1 \n adc %3, %6 \n"
        " clr r1 \n mov r0, %3 \n lsl r0 \n sbc r0, r0 \n"
        " add %A0, %A2 \n adc %B0, %B2 \n adc %C0, %C2 \n adc %D0, %D2 \n adc %A1, %3 \n adc %B1, r0 \n"
        : "+r"(low_), "+r"(high_), "=&r"(t), "=&r"(t4)
        : "a"(a), "a"(b), "r"(static_cast<uint8_t>(0))
        : "r0");
#else
    sum_ += static_cast<int64_t>(a) * b;
#endif
  }

  // a x b for any a.
  void add_long(int32_t a, int16_t b) {
#ifdef __AVR__
    const int32_t low = mixed_product(lower(a), b), high = signed_product(upper(a), b);
    __asm__(
        " mov r0, %D2 \n lsl r0 \n sbc r0, r0 \n"
        " add %A0, %A2 \n adc %B0, %B2 \n adc %C0, %C2 \n adc %D0, %D2 \n adc %A1, r0 \n adc %B1, r0 \n"
        " add %C0, %A3 \n adc %D0, %B3 \n adc %A1, %C3 \n adc %B1, %D3 \n"
        : "+r"(low_), "+r"(high_)
        : "r"(low), "r"(high)
        : "r0");
#else
    sum_ += static_cast<int64_t>(a) * b;
#endif
  }

  void add(int32_t value) {
#ifdef __AVR__
    const uint32_t before = low_;
    low_ += static_cast<uint32_t>(value);
    high_ = static_cast<int16_t>(high_ + (value < 0 ? -1 : 0) + (low_ < before));
#else
    sum_ += value;
#endif
  }

  int32_t value() const {                        // the sum itself, saturated
#ifdef __AVR__
    if (high_ == 0 && static_cast<int32_t>(low_) >= 0) return static_cast<int32_t>(low_);
    if (high_ == -1 && static_cast<int32_t>(low_) < 0) return static_cast<int32_t>(low_);
    return high_ < 0 ? kLeast : kMost;
#else
    return static_cast<int32_t>(clamp<int64_t>(sum_, kLeast, kMost));
#endif
  }

  int16_t top() const {                          // the sum / 2^32, rounded down
#ifdef __AVR__
    return high_;
#else
    return static_cast<int16_t>(sum_ >> 32);
#endif
  }

  int32_t whole() const {                        // the sum as a whole number, rounded down
#ifdef __AVR__
    return static_cast<int32_t>(low_ >> 16 | static_cast<uint32_t>(high_) << 16);
#else
    return static_cast<int32_t>(sum_ >> 16);
#endif
  }

 private:
#ifdef __AVR__
  uint32_t low_;
  int16_t high_;
#else
  int64_t sum_;
#endif
};

// a x b / 2^16, rounded down. Shifts by whole bytes only: this processor has no others worth the name.
inline int32_t part(int32_t a, int16_t b) { return signed_product(upper(a), b) + upper(mixed_product(lower(a), b)); }

// The same for a factor b in [0, 1) as Q16.
inline int32_t fraction(int32_t a, uint16_t b) {
  return mixed_product(b, upper(a)) + static_cast<int32_t>(unsigned_product(lower(a), b) >> 16);
}

// value x scale as an integer; false when it is not finite or needs more than 32 bits. Not for the control interrupt.
inline bool to_fixed(float value, float scale, int32_t &fixed) {
  const float scaled = value * scale;
  if (!(scaled > -2147483000.0f && scaled < 2147483000.0f)) return false;
  fixed = static_cast<int32_t>(scaled + (scaled < 0 ? -0.5f : 0.5f));
  return true;
}

}  // namespace flexura
