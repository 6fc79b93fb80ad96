// Pack<N>: N doubles that go through the equations together, in one register of the processor where
// it has one that wide.
//
// The register is a vector type of GCC and clang, or with FLEXURA_PORTABLE a plain array, for any
// other compiler. Every lane sees the operations that a double would see, in the same order, so the
// digits are the same in both and in a double. This is the only file of the core that is not
// standard C++.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>

namespace flexura {

#ifdef FLEXURA_PORTABLE

template <int N>
struct RegisterOf {
  struct type {
    double lane[N];
    double operator[](int k) const { return lane[k]; }
    double &operator[](int k) { return lane[k]; }
  };
};
template <int N, class Operation>
inline typename RegisterOf<N>::type each(const typename RegisterOf<N>::type &a,
                                         const typename RegisterOf<N>::type &b,
                                         Operation operation) {
  typename RegisterOf<N>::type c;
  for (int k = 0; k < N; ++k) c[k] = operation(a[k], b[k]);
  return c;
}
template <int N>
struct Arithmetic {
  using Register = typename RegisterOf<N>::type;
  static Register fill(double x) {
    Register a;
    for (int k = 0; k < N; ++k) a[k] = x;
    return a;
  }
  static Register minus(const Register &a) {
    return each<N>(a, a, [](double x, double) { return -x; });
  }
  static Register sum(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x + y; });
  }
  static Register difference(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x - y; });
  }
  static Register product(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x * y; });
  }
  static Register quotient(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x / y; });
  }
  static Register choose_less(const Register &a, const Register &b, const Register &x,
                              const Register &y) {
    Register c;
    for (int k = 0; k < N; ++k) c[k] = a[k] < b[k] ? x[k] : y[k];
    return c;
  }
  static Register larger(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x > y || x != x ? x : y; });
  }
  static Register smaller(const Register &a, const Register &b) {
    return each<N>(a, b, [](double x, double y) { return x < y || x != x ? x : y; });
  }
};

#else

template <int N>
struct RegisterOf;  // GCC takes no template parameter as the size of a vector
template <>
struct RegisterOf<2> {
  typedef double type __attribute__((vector_size(16)));
};
template <>
struct RegisterOf<4> {
  typedef double type __attribute__((vector_size(32)));
};
template <>
struct RegisterOf<8> {
  typedef double type __attribute__((vector_size(64)));
};

template <int N>
struct Arithmetic {
  using Register = typename RegisterOf<N>::type;
  static Register fill(double x) {
    return x - Register{};
  }  // minus zero: x + 0 would lose the sign of a zero
  static Register minus(Register a) { return -a; }
  static Register sum(Register a, Register b) { return a + b; }
  static Register difference(Register a, Register b) { return a - b; }
  static Register product(Register a, Register b) { return a * b; }
  static Register quotient(Register a, Register b) { return a / b; }
  static Register choose_less(Register a, Register b, Register x, Register y) {
    return a < b ? x : y;
  }
  static Register larger(Register a, Register b) { return ((a > b) | (a != a)) ? a : b; }
  static Register smaller(Register a, Register b) { return ((a < b) | (a != a)) ? a : b; }
};

#endif

template <int N>
struct Pack {
  using Do = Arithmetic<N>;
  typename RegisterOf<N>::type v;

  Pack() = default;
  Pack(double x) : v(Do::fill(x)) {}  // the same number in every lane
  explicit Pack(const typename RegisterOf<N>::type &x) : v(x) {}

  double operator[](int k) const { return v[k]; }
  void set(int k, double x) { v[k] = x; }

  Pack operator-() const { return Pack(Do::minus(v)); }
  friend Pack operator+(Pack a, Pack b) { return Pack(Do::sum(a.v, b.v)); }
  friend Pack operator-(Pack a, Pack b) { return Pack(Do::difference(a.v, b.v)); }
  friend Pack operator*(Pack a, Pack b) { return Pack(Do::product(a.v, b.v)); }
  friend Pack operator/(Pack a, Pack b) { return Pack(Do::quotient(a.v, b.v)); }
  Pack &operator+=(Pack b) { return *this = *this + b; }
  Pack &operator-=(Pack b) { return *this = *this - b; }
  Pack &operator*=(Pack b) { return *this = *this * b; }
  Pack &operator/=(Pack b) { return *this = *this / b; }
};

// What takes the place of branches on a value. For doubles and for packs, lane by lane.

// x where a < b, otherwise y.
inline double choose_less(double a, double b, double x, double y) { return a < b ? x : y; }
template <int N>
inline Pack<N> choose_less(Pack<N> a, Pack<N> b, Pack<N> x, Pack<N> y) {
  return Pack<N>(Arithmetic<N>::choose_less(a.v, b.v, x.v, y.v));
}

// A function of one double on every lane.
template <class Function>
inline double lanewise(double x, Function function) {
  return function(x);
}
template <int N, class Function>
inline Pack<N> lanewise(Pack<N> x, Function function) {
  Pack<N> y;
  for (int k = 0; k < N; ++k) y.set(k, function(x[k]));
  return y;
}

// The bits of a double, and the double with these bits.
inline std::uint64_t bits(double x) {
  std::uint64_t b;
  std::memcpy(&b, &x, sizeof b);
  return b;
}
inline double from_bits(std::uint64_t b) {
  double x;
  std::memcpy(&x, &b, sizeof x);
  return x;
}

inline double root(double x) { return std::sqrt(x); }  // correctly rounded, by IEEE 754
template <int N>
inline Pack<N> root(Pack<N> x) {
  return lanewise(x, [](double z) { return std::sqrt(z); });
}
inline double abs(double x) { return std::fabs(x); }
template <int N>
inline Pack<N> abs(Pack<N> x) {
  return lanewise(x, [](double z) { return std::fabs(z); });
}

// The larger and the smaller of two numbers. What is not a number stays visible: it is the answer,
// wherever it stands.
inline double larger(double a, double b) { return a > b || a != a ? a : b; }
inline double smaller(double a, double b) { return a < b || a != a ? a : b; }
template <int N>
inline Pack<N> larger(Pack<N> a, Pack<N> b) {
  return Pack<N>(Arithmetic<N>::larger(a.v, b.v));
}
template <int N>
inline Pack<N> smaller(Pack<N> a, Pack<N> b) {
  return Pack<N>(Arithmetic<N>::smaller(a.v, b.v));
}

// The largest and the smallest lane.
inline double worst(double x) { return x; }
inline double least(double x) { return x; }
template <int N>
inline double worst(Pack<N> x) {
  double w = x[0];
  for (int k = 1; k < N; ++k) w = larger(w, x[k]);
  return w;
}
template <int N>
inline double least(Pack<N> x) {
  double w = x[0];
  for (int k = 1; k < N; ++k) w = smaller(w, x[k]);
  return w;
}

// 2^k for a whole number -1022 <= k <= 1023. Adding 1.5 * 2^52 puts k into the last bits.
inline double power_of_two(double k) { return from_bits((bits(k + 0x1.8p52) + 1023) << 52); }
template <int N>
inline Pack<N> power_of_two(Pack<N> k) {
  return lanewise(k, [](double z) { return power_of_two(z); });
}

}  // namespace flexura
