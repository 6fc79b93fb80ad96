// Three sets of dual numbers: by q, v and forces (linearization.hpp).
#include "statics_and_modes/linearization.hpp"

#include <algorithm>

#include "dynamics/inverse_dynamics.hpp"
#include "link/assembly.hpp"

namespace flexura {

Linear linearise(const Model<double> &model, const double *q, const double *v, const double *force,
                 const char *held) {
  using Number = Dual<4>;
  const int n = model.n;
  const Model<Number> moved = dual(model);
  Workspace<Number> work(moved);
  std::vector<Number> y(n), rate(n), f(n), a(n), given(model.links(), Number(0.0)),
      reaction(model.links());
  std::vector<char> moves(n, 1);
  for (int i = 0; held && i < model.links(); ++i) moves[model.first[i]] = held[i] == 0;
  for (int k = 0; k < n; ++k) y[k] = q[k], rate[k] = v[k], f[k] = force[k];
  Linear out;
  out.acceleration.assign(n, 0.0);
  const Stage<Number> plain{y.data(), rate.data(), 0.0, 0.0, nullptr, nullptr};
  const Held<Number> hold{held, given.data(), reaction.data()};
  auto differentiate = [&](std::vector<Number> &by, std::vector<double> &matrix) {
    matrix.assign(n * n, 0.0);
    for (int first = 0; first < n; first += 4) {
      const int end = std::min(first + 4, n);
      for (int k = first; k < end; ++k) by[k].d.set(k - first, 1.0);
      accelerate(moved, work, y.data(), rate.data(), plain, f.data(), hold, a.data());
      for (int i = 0; i < n; ++i) {
        out.acceleration[i] = a[i].v;
        for (int k = first; k < end; ++k)
          matrix[i * n + k] = moves[i] && moves[k] ? a[i].d[k - first] : 0.0;
      }
      for (int k = first; k < end; ++k) by[k].d = Pack<4>(0.0);
    }
  };
  differentiate(y, out.by_position), differentiate(rate, out.by_rate),
      differentiate(f, out.by_force);
  return out;
}

}  // namespace flexura
