// Numbers of a robot's modes, four at a time. Of one robot (Real = double) a register takes four
// modes, of four robots (Real = Pack<4>) one mode of each: the same operations on the same number
// in both, so a robot's digits are the same in both.
#pragma once
#include <cstddef>
#include <cstring>
#include <vector>

#include "numbers/pack_lane.hpp"

namespace flexura {

using Lanes = Pack<4>;

// Chunks that n numbers take, and numbers that these have room for.
template <class Real>
constexpr int chunks_of(int n) {
  return LanesOf<Real>::value == 1 ? padded(n) / 4 : n;
}
template <class Real>
constexpr int room_of(int n) {
  return LanesOf<Real>::value == 1 ? padded(n) : n;
}

inline Lanes get(const double *at, int chunk) {
  Lanes x;
  std::memcpy(&x, at + 4 * chunk, sizeof x);
  return x;
}
inline Lanes get(const Lanes *at, int chunk) { return at[chunk]; }
inline void put(double *at, int chunk, Lanes x) { std::memcpy(at + 4 * chunk, &x, sizeof x); }
inline void put(Lanes *at, int chunk, Lanes x) { at[chunk] = x; }

// A number that all modes of a robot share.
inline Lanes wide(double x) { return Lanes(x); }
inline Lanes wide(Lanes x) { return x; }

// out += sum_k x_k row_k over n rows of a matrix whose rows are `stride` numbers apart.
template <class Real>
inline void add_rows(int n, int chunks, const Real *x, const Real *rows, int stride, Real *out) {
  int c = 0;
  for (; c + 4 <= chunks; c += 4) {  // four sums at a time: one alone would wait for itself
    Lanes s0 = get(out, c), s1 = get(out, c + 1), s2 = get(out, c + 2), s3 = get(out, c + 3);
    for (int k = 0; k < n; ++k) {
      const Real *row = rows + static_cast<std::ptrdiff_t>(k) * stride;
      const Lanes factor = wide(x[k]);
      s0 += factor * get(row, c), s1 += factor * get(row, c + 1), s2 += factor * get(row, c + 2),
          s3 += factor * get(row, c + 3);
    }
    put(out, c, s0), put(out, c + 1, s1), put(out, c + 2, s2), put(out, c + 3, s3);
  }
  for (; c < chunks; ++c) {
    Lanes s = get(out, c);
    for (int k = 0; k < n; ++k)
      s += wide(x[k]) * get(rows + static_cast<std::ptrdiff_t>(k) * stride, c);
    put(out, c, s);
  }
}

// sum_k x_k y_k over n modes: in both layouts four sums, which are added in the same order.
inline double dot(int n, const double *x, const double *y) {
  Lanes s = 0.0;
  for (int c = 0; c < padded(n) / 4; ++c) s += get(x, c) * get(y, c);
  return (s[0] + s[1]) + (s[2] + s[3]);
}
inline Lanes dot(int n, const Lanes *x, const Lanes *y) {
  Lanes s[4] = {0.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < n; ++k) s[k % 4] += x[k] * y[k];
  return (s[0] + s[1]) + (s[2] + s[3]);
}

// A block of memory from which arrays are taken one after the other, zeros at first.
template <class Real>
class Block {
 public:
  // Calls `lay(take)` twice: to count, then to place; take(array, size) points `array` at `size`
  // numbers.
  template <class Lay>
  void lay(Lay lay) {
    std::size_t size = 0;
    lay([&](Real *&, int count) { size += static_cast<std::size_t>(count); });
    numbers_.assign(size, Real(0.0));
    Real *at = numbers_.data();
    lay([&](Real *&array, int count) { array = at, at += count; });
  }

 private:
  std::vector<Real> numbers_;
};

// ---- products of square matrices (n, n), row by row. Each number is one sum in ascending order,
// so its digits do not depend on how many are formed at a time.

// out_l = sum_k x_k B_kl for l < end, x_k at x[k * step]. Zeros of x are left out.
inline void row_product(int n, const double *x, int step, const double *B, int end, double *out) {
  int l = 0;
  for (; l + 16 <= end; l += 16) {
    Lanes s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
    for (int k = 0; k < n; ++k) {
      const double factor = x[std::ptrdiff_t(k) * step];
      if (factor == 0.0) continue;
      const double *row = B + std::ptrdiff_t(k) * n + l;
      const Lanes f = factor;
      s0 += f * get(row, 0), s1 += f * get(row, 1), s2 += f * get(row, 2), s3 += f * get(row, 3);
    }
    put(out + l, 0, s0), put(out + l, 1, s1), put(out + l, 2, s2), put(out + l, 3, s3);
  }
  for (; l + 4 <= end; l += 4) {
    Lanes s = 0.0;
    for (int k = 0; k < n; ++k) {
      const double factor = x[std::ptrdiff_t(k) * step];
      if (factor != 0.0) s += Lanes(factor) * get(B + std::ptrdiff_t(k) * n + l, 0);
    }
    put(out + l, 0, s);
  }
  for (; l < end; ++l) {
    double s = 0.0;
    for (int k = 0; k < n; ++k) {
      const double factor = x[std::ptrdiff_t(k) * step];
      if (factor != 0.0) s += factor * B[std::ptrdiff_t(k) * n + l];
    }
    out[l] = s;
  }
}

// A B into `out`.
inline void product(int n, const std::vector<double> &A, const std::vector<double> &B,
                    std::vector<double> &out) {
  for (int i = 0; i < n; ++i)
    row_product(n, A.data() + std::ptrdiff_t(i) * n, 1, B.data(), n,
                out.data() + std::ptrdiff_t(i) * n);
}

// S^T B, which is known to be symmetric, into `out`.
inline void symmetric_product(int n, const std::vector<double> &S, const std::vector<double> &B,
                              std::vector<double> &out) {
  for (int a = 0; a < n; ++a)
    row_product(n, S.data() + a, n, B.data(), a + 1, out.data() + std::ptrdiff_t(a) * n);
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < a; ++b)
      out[std::size_t(b) * std::size_t(n) + std::size_t(a)] =
          out[std::size_t(a) * std::size_t(n) + std::size_t(b)];
}

}  // namespace flexura
