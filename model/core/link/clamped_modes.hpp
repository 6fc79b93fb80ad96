// The own modes of a clamped link in a space of shapes: (17) to (19). For one robot, or for four at
// once with the same digits.
#pragma once
#include <vector>

#include "numbers/eigenproblem.hpp"

namespace flexura {

// A space of m shapes: stiffness K and mass M (m, m) of the clamped link, its payload included; of
// each shape the tip's deflection and the tip's angle (m).
template <class Real>
struct ClampedLink {
  int m = 0;
  std::vector<Real> K, M, deflection, angle;
};

// Modes as sums of the shapes (18), X (m, count): x . M x = 1, the tip goes to the left; the
// squares of their frequencies (count).
template <class Real>
struct ClampedModes {
  int count = 0;
  std::vector<Real> X, squares;
};

// Y^T A Y of a symmetric A (m, m) and Y (m, k).
template <class Real>
std::vector<Real> congruent(const Real *A, const Real *Y, int m, int k) {
  std::vector<Real> AY(std::size_t(m * k), Real(0.0)), out(std::size_t(k * k), Real(0.0));
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int c = 0; c < k; ++c) AY[std::size_t(i * k + c)] += A[i * m + j] * Y[j * k + c];
  for (int i = 0; i < m; ++i)
    for (int a = 0; a < k; ++a)
      for (int c = 0; c < k; ++c)
        out[std::size_t(a * k + c)] += Y[i * k + a] * AY[std::size_t(i * k + c)];
  return out;
}

// The first `count` columns of X (m, width).
template <class Real>
std::vector<Real> first_columns(const std::vector<Real> &X, int m, int width, int count) {
  std::vector<Real> out(std::size_t(m * count));
  for (int i = 0; i < m; ++i)
    for (int k = 0; k < count; ++k) out[std::size_t(i * count + k)] = X[std::size_t(i * width + k)];
  return out;
}

// The static shape of a load (m) less what the modes have of it, as large as the last of them is.
template <class Real>
std::vector<Real> static_shape(const ClampedLink<Real> &link, const Real *L,
                               const std::vector<Real> &load, const ClampedModes<Real> &modes) {
  const int m = link.m, kept = modes.count;
  std::vector<Real> shape = load;
  solve_lower(m, L, shape.data()), solve_upper(m, L, shape.data());
  for (int k = 0; k < kept; ++k) {
    Real part = 0.0;
    for (int i = 0; i < m; ++i) part += modes.X[std::size_t(i * kept + k)] * load[std::size_t(i)];
    part = part / modes.squares[std::size_t(k)];
    for (int i = 0; i < m; ++i) shape[std::size_t(i)] -= part * modes.X[std::size_t(i * kept + k)];
  }
  Real energy = 0.0;
  for (int i = 0; i < m; ++i) energy += shape[std::size_t(i)] * load[std::size_t(i)];
  const Real scale =
      root(modes.squares[std::size_t(kept > 0 ? kept - 1 : 0)] / larger(abs(energy), Real(1e-300)));
  for (Real &x : shape) x = scale * x;
  return shape;
}

// Shapes whose stiffness is diagonal: each is one of the space less what those before it would bend
// with it, X^T K X = diag(squares). Of a uniform link the space's own. What K has of round-off
// between orthogonal shapes is taken away first.
template <class Real>
ClampedModes<Real> orthogonal_shapes(const ClampedLink<Real> &link) {
  const int m = link.m;
  std::vector<Real> L = link.K;
  for (int i = 0; i < m; ++i)
    for (int k = 0; k < i; ++k) {
      Real &own = L[std::size_t(i * m + k)];
      own = choose_less(
          abs(own), 1e-14 * root(link.K[std::size_t(i * m + i)] * link.K[std::size_t(k * m + k)]),
          Real(0.0), own);
    }
  cholesky(m, L.data());
  ClampedModes<Real> out;
  out.count = m, out.X.assign(std::size_t(m * m), Real(0.0)), out.squares.resize(std::size_t(m));
  std::vector<Real> x(std::size_t(m), Real(0.0));
  for (int k = 0; k < m; ++k) {
    const Real own = L[std::size_t(k * m + k)];
    for (Real &value : x) value = Real(0.0);
    x[std::size_t(k)] = own, out.squares[std::size_t(k)] = own * own;
    solve_upper(m, L.data(), x.data());
    for (int i = 0; i < m; ++i) out.X[std::size_t(i * m + k)] = x[std::size_t(i)];
  }
  return out;
}

// The `lowest` modes, of fewer than there are. If another link follows, the static shapes of a
// force and a moment at the tip come to them.
template <class Real>
ClampedModes<Real> clamped_modes(const ClampedLink<Real> &link, int lowest, bool follower) {
  const int m = link.m;
  ClampedModes<Real> out;
  std::vector<Real> squares(std::size_t(m), Real(0.0)), all(std::size_t(m * m), Real(0.0));
  eigen_definite(m, link.K.data(), link.M.data(), squares.data(), all.data());
  out.count = lowest, out.X = first_columns(all, m, m, lowest), out.squares = squares;
  if (follower) {
    const int wide = lowest + 2 < m ? lowest + 2 : m;
    std::vector<Real> Y(std::size_t(m * wide)), L = link.K, Z(std::size_t(wide * wide));
    cholesky(m, L.data());
    for (int k = 0; k < wide; ++k) {
      const std::vector<Real> extra =
          k < lowest
              ? std::vector<Real>()
              : static_shape(link, L.data(), k == lowest ? link.deflection : link.angle, out);
      for (int i = 0; i < m; ++i)
        Y[std::size_t(i * wide + k)] =
            k < lowest ? out.X[std::size_t(i * lowest + k)] : extra[std::size_t(i)];
    }
    const auto K = congruent(link.K.data(), Y.data(), m, wide),
               M = congruent(link.M.data(), Y.data(), m, wide);
    out.squares.assign(std::size_t(wide), Real(0.0));
    eigen_definite(wide, K.data(), M.data(), out.squares.data(), Z.data());
    out.count = wide, out.X.assign(std::size_t(m * wide), Real(0.0));
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < wide; ++k)
        for (int l = 0; l < wide; ++l)
          out.X[std::size_t(i * wide + k)] +=
              Y[std::size_t(i * wide + l)] * Z[std::size_t(l * wide + k)];
  }
  out.squares.resize(std::size_t(out.count));
  for (int k = 0; k < out.count; ++k) {  // the tip goes to the left
    Real tip = 0.0;
    for (int i = 0; i < m; ++i)
      tip += out.X[std::size_t(i * out.count + k)] * link.deflection[std::size_t(i)];
    for (int i = 0; i < m; ++i) {
      Real &x = out.X[std::size_t(i * out.count + k)];
      x = choose_less(tip, Real(0.0), -x, x);
    }
  }
  return out;
}

}  // namespace flexura
