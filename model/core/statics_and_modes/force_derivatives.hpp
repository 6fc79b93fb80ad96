// Derivatives of the forces of a motion (59), and the tip's place with its own: what Newton's
// method needs where a whole motion is the unknown.
#pragma once
#include <vector>

#include "robot/model.hpp"

namespace flexura {

// The robot with dual numbers, and the memory of its evaluations: for many states one after
// another.
class ForceDerivatives {
 public:
  explicit ForceDerivatives(const Model<double> &model);

  // At q, v, a (n): the forces (n) with gravity, stiffness and damping, without Coulomb friction;
  // their derivatives by q and by v (n, n), row by row; the tip's x, y and their derivatives by q
  // (2, n). The derivative by a is M(q).
  void at(const double *q, const double *v, const double *a, double *force, double *by_position,
          double *by_rate, double *tip, double *tip_by_position);

 private:
  Model<Dual<4>> model_;
  Workspace<Dual<4>> work_;
  std::vector<Dual<4>> q_, v_, a_, out_;
};

}  // namespace flexura
