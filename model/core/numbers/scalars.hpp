// The kinds of numbers that the equations are instantiated with: double; Pack<N>, N robots side by
// side; Dual<N>, a number with its derivatives in N directions. And Row<Real, N>, several such
// numbers that take part in the same operation.
//
// All know + - * / and the functions below, which are arithmetic alone: no library decides a digit,
// and a lane of a pack has the bits of a double. No equation may branch on a value of type Real;
// use choose_less, larger, smaller, abs.
#pragma once
#include "numbers/pack.hpp"

namespace flexura {

// A value and its derivatives in N directions (forward mode).
template <int N>
struct Dual {
  double v;
  Pack<N> d;

  Dual() = default;
  Dual(double x) : v(x), d(0.0) {}
  Dual(double x, Pack<N> dx) : v(x), d(dx) {}

  Dual operator-() const { return {-v, -d}; }
  friend Dual operator+(Dual a, Dual b) { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(Dual a, Dual b) { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator*(Dual a, Dual b) { return {a.v * b.v, a.d * b.v + b.d * a.v}; }
  friend Dual operator/(Dual a, Dual b) {
    const double q = a.v / b.v;
    return {q, (a.d - b.d * q) * (1.0 / b.v)};
  }
  Dual &operator+=(Dual b) { return *this = *this + b; }
  Dual &operator-=(Dual b) { return *this = *this - b; }
  Dual &operator*=(Dual b) { return *this = *this * b; }
  Dual &operator/=(Dual b) { return *this = *this / b; }
};

template <int N>
inline Dual<N> choose_less(Dual<N> a, Dual<N> b, Dual<N> x, Dual<N> y) {
  return a.v < b.v ? x : y;
}
template <int N>
inline Dual<N> larger(Dual<N> a, Dual<N> b) {
  return a.v > b.v || a.v != a.v ? a : b;
}
template <int N>
inline Dual<N> smaller(Dual<N> a, Dual<N> b) {
  return a.v < b.v || a.v != a.v ? a : b;
}
template <int N>
inline double worst(Dual<N> x) {
  return x.v;
}
template <int N>
inline double least(Dual<N> x) {
  return x.v;
}
template <int N>
inline Dual<N> abs(Dual<N> x) {
  return {std::fabs(x.v), x.d * std::copysign(1.0, x.v)};
}
template <int N>
inline Dual<N> root(Dual<N> x) {
  const double r = std::sqrt(x.v);
  return {r, x.d * (0.5 / r)};
}

// ---- elementary functions

// The nearest whole number of |x| < 2^51, halves to even: adding 1.5 * 2^52 rounds to it.
template <class Real>
inline Real nearest(Real x) {
  return (x + 0x1.8p52) - 0x1.8p52;
}

// sin x and cos x, within 1.5 units in the last place for |x| < 100 and 2.5 for |x| < 1e5; beyond,
// errors grow as x^2. With k the nearest multiple of pi/2 and r = x - k pi/2, sin x = sin r cos(k
// pi/2) + cos r sin(k pi/2). pi/2 is taken in three parts, so that the products with k are exact.
// The two series are those of Sun's fdlibm.
template <class Real>
inline void sincos(Real x, Real &sine, Real &cosine) {
  const Real k = nearest(x * 0x1.45f306dc9c883p-1);
  const Real r = ((x - k * 0x1.921fb544p+0) - k * 0x1.0b4611a6p-34) - k * 0x1.3198a2e037073p-69;
  const Real turn = k - 4.0 * nearest(0.25 * k), square = turn * turn;  // -2 ... 2 quarters
  const Real even = 1.0 - square * (7.0 - square) * (1.0 / 6.0);        // cos(k pi/2): 1, 0 or -1
  const Real odd = turn * (4.0 - square) * (1.0 / 3.0);                 // sin(k pi/2)
  const Real z = r * r;
  const Real s5 = -0x1.ae5e68a2b9cebp-26 + z * 0x1.5d93a5acfd57cp-33;
  const Real s3 = -0x1.a01a019c161d5p-13 + z * (0x1.71de357b1fe7dp-19 + z * s5);
  const Real s1 = -0x1.5555555555549p-3 + z * (0x1.111111110f8a6p-7 + z * s3);
  const Real s = r + r * z * s1;
  const Real c5 = 0x1.1ee9ebdb4b1c4p-29 + z * -0x1.8fae9be8838d4p-37;
  const Real c3 = 0x1.a01a019cb1590p-16 + z * (-0x1.27e4f809c52adp-22 + z * c5);
  const Real c1 = 0x1.555555555554cp-5 + z * (-0x1.6c16c16c15177p-10 + z * c3);
  const Real half = 0.5 * z, whole = 1.0 - half;
  const Real c = whole + (((1.0 - whole) - half) + z * z * c1);
  sine = even * s + odd * c;
  cosine = even * c - odd * s;
}

// e^r - 1 and k for x = k ln 2 + r, |r| <= ln(2)/2; the series, of r coth(r/2), is that of fdlibm.
template <class Real>
inline Real reduced_exponential(Real x, Real &k) {
  k = nearest(x * 0x1.71547652b82fep+0);
  const Real high = x - k * 0x1.62e42feep-1, low = k * 0x1.a39ef35793c76p-33, r = high - low,
             z = r * r;
  const Real p3 = 0x1.1566aaf25de2cp-14 + z * (-0x1.bbd41c5d26bf1p-20 + z * 0x1.6376972bea4d0p-25);
  const Real c = r - z * (0x1.555555555553ep-3 + z * (-0x1.6c16c16bebd93p-9 + z * p3));
  return high - (low - r * c / (2.0 - c));
}

// e^x within 1.5 units in the last place, for every x: infinity above 709.78, towards zero through
// the subnormals below -708.
template <class Real>
inline Real exponential(Real x) {
  Real k;
  const Real e = 1.0 + reduced_exponential(smaller(larger(x, Real(-800.0)), Real(800.0)), k);
  const Real half = nearest(0.5 * k);  // in two steps, since 2^k itself may not be a number
  return e * power_of_two(half) * power_of_two(k - half);
}

// tanh x within 3 units in the last place: with a = |x| and m = e^(2a) - 1, m / (m + 2).
template <class Real>
inline Real hyperbolic_tangent(Real x) {
  Real k;
  const Real e = reduced_exponential(smaller(2.0 * abs(x), Real(50.0)), k);
  const Real scale = power_of_two(k), m = e * scale + (scale - 1.0), t = m / (m + 2.0);
  return choose_less(x, Real(0.0), -t, t);
}

// A normal number x > 0 is 2^k f with sqrt(1/2) <= f < sqrt(2): gives k, and puts f in the place of
// x.
inline double split_exponent(double &x) {
  const std::uint64_t whole = (bits(x) - 0x3fe6a09e667f3bcdu) >> 52 << 52;
  x = from_bits(bits(x) - whole);
  return static_cast<double>(static_cast<std::int64_t>(whole) / (std::int64_t{1} << 52));
}
template <int N>
inline Pack<N> split_exponent(Pack<N> &x) {
  Pack<N> k;
  for (int lane = 0; lane < N; ++lane) {
    double f = x[lane];
    k.set(lane, split_exponent(f));
    x.set(lane, f);
  }
  return k;
}

// ln x of a normal number x > 0 (2.2e-308 and more), within 1.5 units in the last place. With f =
// x/2^k - 1 and s = f/(2 + f), ln(1 + f) = 2 s + s R(s^2); the series is that of fdlibm. Zero,
// subnormal and negative numbers and infinity give what is not a number.
template <class Real>
inline Real natural_logarithm(Real x) {
  Real fraction = x;
  const Real k = split_exponent(fraction), f = fraction - 1.0, s = f / (2.0 + f), z = s * s;
  const Real r5 = 0x1.7466496cb03dep-3 + z * (0x1.39a09d078c69fp-3 + z * 0x1.2f112df3e5244p-3);
  const Real r3 = 0x1.2492494229359p-2 + z * (0x1.c71c51d8e78afp-3 + z * r5);
  const Real r = z * (0x1.5555555555593p-1 + z * (0x1.999999997fa04p-2 + z * r3));
  const Real half = 0.5 * f * f;
  const Real y = k * 0x1.62e42feep-1 - ((half - (s * (half + r) + k * 0x1.a39ef35793c76p-33)) - f);
  return choose_less(x, Real(0x1p-1022), Real(NAN), choose_less(x, Real(INFINITY), y, Real(NAN)));
}

inline double exp(double x) { return exponential(x); }
inline double log(double x) { return natural_logarithm(x); }
inline double tanh(double x) { return hyperbolic_tangent(x); }
template <int N>
inline Pack<N> exp(Pack<N> x) {
  return exponential(x);
}
template <int N>
inline Pack<N> log(Pack<N> x) {
  return natural_logarithm(x);
}
template <int N>
inline Pack<N> tanh(Pack<N> x) {
  return hyperbolic_tangent(x);
}

// x^p for x > 0 within 1e-15 (1 + |p ln x|), relative: for the lengths of steps, where the
// library's pow may differ between machines.
template <class Real>
inline Real power(Real x, double p) {
  return exp(Real(p) * log(x));
}

template <int N>
inline void sincos(Dual<N> x, Dual<N> &sine, Dual<N> &cosine) {
  double s, c;
  sincos(x.v, s, c);
  sine = {s, x.d * c};
  cosine = {c, x.d * -s};
}
template <int N>
inline Dual<N> exp(Dual<N> x) {
  const double e = exp(x.v);
  return {e, x.d * e};
}
template <int N>
inline Dual<N> log(Dual<N> x) {
  return {log(x.v), x.d * (1.0 / x.v)};
}
template <int N>
inline Dual<N> tanh(Dual<N> x) {
  const double t = tanh(x.v);
  return {t, x.d * ((1.0 - t) * (1.0 + t))};
}

// ---- rows

// N numbers in a row: columns of a small matrix, or points along a link. Of doubles four are taken
// at a time, so that one robot uses the processor's lanes too; each number sees the same operations
// in the same order as in any other layout.
//
// The functions take `count`, how many of the N are used, and work on whole chunks of four doubles.
// Memory that a row is loaded from or stored to therefore has padded(count) numbers; what stands
// behind count must be initialised and never matters.
constexpr int padded(int count) { return (count + 3) / 4 * 4; }

template <class Real, int N>
struct Row {
  using Chunk = Real;
  static constexpr int chunks(int count) { return count; }
  static constexpr int chunk_of(int k) { return k; }
  Chunk c[N];

  Real operator[](int k) const { return c[k]; }
  void set(int k, Real x) { c[k] = x; }
  static Chunk load(const Real *at, int chunk) { return at[chunk]; }
  static void store(Real *at, int chunk, Chunk x) { at[chunk] = x; }
};

template <int N>
struct Row<double, N> {
  using Chunk = Pack<4>;
  static constexpr int chunks(int count) { return (count + 3) / 4; }
  static constexpr int chunk_of(int k) { return k / 4; }
  Chunk c[(N + 3) / 4];

  double operator[](int k) const { return c[k / 4][k % 4]; }
  void set(int k, double x) { c[k / 4].set(k % 4, x); }
  static Chunk load(const double *at, int chunk) {
    Chunk x;
    std::memcpy(&x, at + 4 * chunk, sizeof x);
    return x;
  }
  static void store(double *at, int chunk, Chunk x) { std::memcpy(at + 4 * chunk, &x, sizeof x); }
};

// x = s, the same number everywhere.
template <class Real, int N>
inline void fill(Row<Real, N> &x, Real s, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] = s;
}
// x = what stands in memory, and the reverse.
template <class Real, int N>
inline void load(Row<Real, N> &x, const Real *at, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] = x.load(at, k);
}
template <class Real, int N>
inline void store(const Row<Real, N> &x, Real *at, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.store(at, k, x.c[k]);
}
// x = s y
template <class Real, int N>
inline void times(Row<Real, N> &x, Real s, const Row<Real, N> &y, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] = y.c[k] * s;
}
template <class Real, int N>
inline void times(Row<Real, N> &x, Real s, const Real *at, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] = x.load(at, k) * s;
}
// x = y z, number by number
template <class Real, int N>
inline void times(Row<Real, N> &x, const Row<Real, N> &y, const Row<Real, N> &z, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] = y.c[k] * z.c[k];
}
// x += s y, from the number `from` on (or from a little before it: whole chunks)
template <class Real, int N>
inline void add(Row<Real, N> &x, Real s, const Row<Real, N> &y, int count, int from = 0) {
  for (int k = x.chunk_of(from); k < x.chunks(count); ++k) x.c[k] += y.c[k] * s;
}
template <class Real, int N>
inline void add(Row<Real, N> &x, Real s, const Real *at, int count) {
  for (int k = 0; k < x.chunks(count); ++k) x.c[k] += x.load(at, k) * s;
}
template <class Real, int N>
inline void sincos(const Row<Real, N> &x, Row<Real, N> &sine, Row<Real, N> &cosine, int count) {
  for (int k = 0; k < x.chunks(count); ++k) sincos(x.c[k], sine.c[k], cosine.c[k]);
}

}  // namespace flexura
