// Polynomials in time through the last values of a quantity. Time counts in steps from the newest value: x = 0 there, x = 1 at the end of
// the step to make, older values at x < 0.
#pragma once
#include "modal.hpp"

namespace flexura {

constexpr int ORDER = 5;      // values that a step looks back on, at most
constexpr int GAP = ORDER;    // the polynomial that is 0 at all values and 1 at x = 1
constexpr int OLDEST = ORDER + 1;  // GAP's less the one that does without the oldest value: what a step is wrong by, about
constexpr int COLUMNS = 8;

// Coefficients by powers of x, [power][column]: Lagrange's polynomials of the values by age, GAP, and OLDEST's.
// Each is multiplied up from its roots. (Dividing the product of all by one would lose four digits where the nodes lie far apart.)
template <class Real> inline void interpolate(int used, const Real *node, Real C[ORDER + 1][COLUMNS]) {
  Real below[COLUMNS], at[COLUMNS];  // the product at the column's own node
  for (int j = 0; j < COLUMNS; ++j) {
    for (int m = 1; m <= ORDER; ++m) C[m][j] = 0.0;
    C[0][j] = below[j] = at[j] = 1.0;
  }
  for (int j = 0; j < used && j < ORDER; ++j) at[j] = node[j];
  for (int i = 0; i < used; ++i) {
    const Real end = i == used - 1 ? Real(1.0) : node[i];  // OLDEST's polynomial has a root at x = 1 in place of the oldest node
    for (int j = 0; j < COLUMNS; ++j) {
      const double skip = j == i, take = 1.0 - skip;
      const Real root = j == OLDEST ? end : node[i];
      below[j] *= skip + take * (at[j] - node[i]);
      for (int m = i + 1; m > 0; --m) C[m][j] = skip * C[m][j] + take * (C[m - 1][j] - root * C[m][j]);
      C[0][j] = skip * C[0][j] - take * (root * C[0][j]);
    }
  }
  for (int j = 0; j < COLUMNS; ++j) {
    const Real scale = j < used || j >= GAP ? 1.0 / below[j] : Real(0.0);
    for (int m = 0; m <= ORDER; ++m) C[m][j] = scale * C[m][j];
  }
}

}  // namespace flexura
