// Polynomials in time through the last values of a quantity, those of the exponential predictor
// (91) and corrector (92). Time counts in steps from the newest value: x = 0 there, x = 1 at the
// end of the step to make, older values at x < 0.
#pragma once
#include "numbers/modal_vectors.hpp"

namespace flexura {

constexpr int ORDER = 5;    // values that a step looks back on, at most
constexpr int GAP = ORDER;  // the polynomial that is 0 at all values and 1 at x = 1
constexpr int OLDEST =
    ORDER +
    1;  // GAP's less the one that does without the oldest value: what a step is wrong by, about
constexpr int COLUMNS = 8;

// Coefficients by powers of x, [power][column]: Lagrange's polynomials (91) of the values by age,
// GAP's (92), and OLDEST's (93). Each is multiplied up from its roots: those of younger values are
// shared, and so are those of older ones. (Dividing the product of all by one would lose four
// digits where the nodes lie far apart.)
template <class Real>
inline void interpolate(int used, const Real *node, Real C[ORDER + 1][COLUMNS]) {
  Real young[ORDER + 1][ORDER + 1],
      old[ORDER + 1][ORDER + 1];  // [i]: roots node_0 ... node_(i-1); node_i ... node_(used-1)
  auto times_root = [](int degree, const Real *p, const Real &root, Real *out) {
    out[degree + 1] = p[degree];
    for (int m = degree; m > 0; --m) out[m] = p[m - 1] - root * p[m];
    out[0] = -(root * p[0]);
  };
  young[0][0] = old[used][0] = 1.0;
  for (int i = 0; i < used; ++i) times_root(i, young[i], node[i], young[i + 1]);
  for (int i = used - 1; i > 0; --i) times_root(used - 1 - i, old[i + 1], node[i], old[i]);
  for (int m = 0; m <= ORDER; ++m)
    for (int j = 0; j < COLUMNS; ++j) C[m][j] = 0.0;
  Real end = 1.0;  // the product of all at x = 1
  for (int j = 0; j < used; ++j) {
    Real below = 1.0;
    for (int i = 0; i < used; ++i)
      if (i != j) below *= node[j] - node[i];
    const Real scale = 1.0 / below;
    for (int a = 0; a <= j; ++a) {
      const Real factor = scale * young[j][a];
      for (int b = 0; b < used - j; ++b) C[a + b][j] += factor * old[j + 1][b];
    }
    end *= 1.0 - node[j];
  }
  const Real scale = 1.0 / end;
  Real last[ORDER + 1];  // OLDEST's has a root at x = 1 in place of the oldest node
  if (used > 0) times_root(used - 1, young[used - 1], Real(1.0), last);
  for (int m = 0; m <= used; ++m)
    C[m][GAP] = scale * young[used][m], C[m][OLDEST] = used > 0 ? scale * last[m] : Real(0.0);
}

}  // namespace flexura
