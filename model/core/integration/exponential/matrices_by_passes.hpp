// Mass, stiffness and damping of one robot at a configuration, from its accelerations and powers
// alone: for any plant that does not know its matrices better (Plant::matrices).
#pragma once
#include "integration/exponential/modal_basis.hpp"

namespace flexura {

// M: the inverse of what unit forces accelerate, n + 1 passes at rest. K and D from the powers,
// bilinear and quadratic in the rates.
template <class Real>
void matrices_by_passes(Plant<Real> &plant, int robot, const Real *q, Matrices &out) {
  const int n = plant.n;
  const std::size_t size = static_cast<std::size_t>(n);
  std::vector<Real> still(size, Real(0.0)), force(size, Real(0.0)), rest(size), a(size),
      joint(static_cast<std::size_t>(plant.joints), Real(0.0));
  std::vector<Real> reaction(joint.size()), probe(size, Real(0.0)), rate(size, Real(0.0));
  const std::vector<char> held(joint.size(), 0);
  const PassInputs<Real> pass{q,
                              still.data(),
                              q,
                              still.data(),
                              Real(0.0),
                              Real(0.0),
                              force.data(),
                              joint.data(),
                              joint.data(),
                              held.data(),
                              joint.data()};
  plant.accelerate(pass, rest.data(), reaction.data());
  std::vector<double> inverse(size * size);
  for (int i = 0; i < n; ++i) {
    force[i] = 1.0;
    plant.accelerate(pass, a.data(), reaction.data());
    force[i] = 0.0;
    for (int j = 0; j < n; ++j) inverse[j * n + i] = lane(a[j] - rest[j], robot);
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      inverse[i * n + j] = inverse[j * n + i] = 0.5 * (inverse[i * n + j] + inverse[j * n + i]);
  cholesky(n, inverse.data());
  for (int i = 0; i < n; ++i) {
    std::vector<double> column(size, 0.0);
    column[i] = 1.0;
    solve_lower(n, inverse.data(), column.data());
    solve_upper(n, inverse.data(), column.data());
    for (int j = 0; j < n; ++j) out.M[j * n + i] = column[j];
  }
  Real strain, loss, less;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      probe[i] = 1.0, rate[j] = 1.0;
      plant.powers(probe.data(), rate.data(), strain, loss);
      out.K[i * n + j] = lane(strain, robot);
      probe[i] = 0.0, rate[j] = 0.0;
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      rate[i] += 1.0, rate[j] += 1.0;
      plant.powers(q, rate.data(), strain, loss);
      rate[i] -= 1.0, rate[j] -= 1.0;
      rate[i] += 1.0, rate[j] -= 1.0;
      plant.powers(q, rate.data(), strain, less);
      rate[i] = rate[j] = 0.0;
      out.D[i * n + j] = out.D[j * n + i] = 0.25 * lane(loss - less, robot);
    }
}

}  // namespace flexura
