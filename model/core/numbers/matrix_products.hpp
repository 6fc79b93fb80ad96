// Products of square matrices (n, n), row by row. Each number is one sum in ascending order, so its
// digits do not depend on how many are formed at a time.
#pragma once
#include <vector>

#include "numbers/modal_vectors.hpp"

namespace flexura {

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

// A B.
inline std::vector<double> product(int n, const std::vector<double> &A,
                                   const std::vector<double> &B) {
  std::vector<double> out(A.size());
  for (int i = 0; i < n; ++i)
    row_product(n, A.data() + std::ptrdiff_t(i) * n, 1, B.data(), n,
                out.data() + std::ptrdiff_t(i) * n);
  return out;
}

// S^T B, which is known to be symmetric.
inline std::vector<double> symmetric_product(int n, const std::vector<double> &S,
                                             const std::vector<double> &B) {
  std::vector<double> out(S.size());
  for (int a = 0; a < n; ++a)
    row_product(n, S.data() + a, n, B.data(), a + 1, out.data() + std::ptrdiff_t(a) * n);
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < a; ++b)
      out[std::size_t(b) * std::size_t(n) + std::size_t(a)] =
          out[std::size_t(a) * std::size_t(n) + std::size_t(b)];
  return out;
}

}  // namespace flexura
