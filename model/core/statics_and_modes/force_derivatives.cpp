#include "statics_and_modes/force_derivatives.hpp"

#include <algorithm>

#include "dynamics/places/positions.hpp"
#include "link/assembly.hpp"

namespace flexura {

ForceDerivatives::ForceDerivatives(const Model<double> &model)
    : model_(dual(model)),
      work_(model_),
      q_(std::size_t(model.n)),
      v_(q_.size()),
      a_(q_.size()),
      out_(q_.size()) {}

void ForceDerivatives::at(const double *q, const double *v, const double *a, double *force,
                          double *by_position, double *by_rate, double *tip,
                          double *tip_by_position) {
  using Number = Dual<4>;
  const int n = model_.n;
  std::vector<Pose<Number>> poses(std::size_t(model_.links()) + 1);
  Number tip_velocity[2];
  for (int k = 0; k < n; ++k) q_[k] = q[k], v_[k] = v[k], a_[k] = a[k];
  auto differentiate = [&](std::vector<Number> &by, double *matrix, bool places) {
    for (int first = 0; first < n; first += 4) {
      const int end = std::min(first + 4, n);
      for (int k = first; k < end; ++k) by[k].d.set(k - first, 1.0);
      forces(model_, work_, q_.data(), v_.data(), a_.data(), Terms{}, out_.data());
      for (int i = 0; i < n; ++i) {
        force[i] = out_[i].v;
        for (int k = first; k < end; ++k) matrix[i * n + k] = out_[i].d[k - first];
      }
      if (places) {
        hub_poses(model_, work_, q_.data(), v_.data(), poses.data(), tip_velocity);
        const Number place[2] = {poses.back().x, poses.back().y};
        for (int i = 0; i < 2; ++i) {
          tip[i] = place[i].v;
          for (int k = first; k < end; ++k) tip_by_position[i * n + k] = place[i].d[k - first];
        }
      }
      for (int k = first; k < end; ++k) by[k].d = Pack<4>(0.0);
    }
  };
  differentiate(q_, by_position, true), differentiate(v_, by_rate, false);
}

}  // namespace flexura
