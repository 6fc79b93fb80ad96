// The motion ahead of a predictive controller: its intervals linearised (131), and the program of a
// tick with the states eliminated (132).
#pragma once
#include <memory>
#include <vector>

#include "statics_and_modes/force_derivatives.hpp"

namespace flexura {

// Of x = (q, v) of the unknowns that move; m of them, n = 2 m states.
class PredictedMotion {
 public:
  // `free`: the unknowns that move (m); `driven`: those of them, by place in `free`, that a drive
  // pushes.
  PredictedMotion(std::shared_ptr<const Model<double>> model, std::vector<int> free,
                  std::vector<int> driven);

  int states() const { return 2 * int(free_.size()); }
  int inputs() const { return int(driven_.size()); }

  // One interval of h seconds from x (n) under held forces u (inputs): x+ = R x + G u + d by Radau
  // IIA of order 3 on the equations linearised there. `a` (m): accelerations, nearly; left as those
  // of the motion.
  void step(const double *x, const double *u, double *a, double h, double *R, double *G, double *d);

 private:
  std::shared_ptr<const Model<double>> model_;
  ForceDerivatives derivatives_;
  std::vector<int> free_, driven_;
  std::vector<double> q_, v_, a_, force_, by_position_, by_rate_, mass_, tip_, tip_by_position_;
  std::vector<double> reduced_, right_, Z_, D_, held_;
};

// A x = B for A (n, n) and B (n, columns), in place, by elimination with partial pivoting: B
// becomes x. Row by row.
void eliminate_dense(std::vector<double> &A, std::vector<double> &B, int n, int columns);

// What is minimised over the forces of N intervals.
struct TickProgram {
  int N, n, inputs, outputs, rows;  // intervals, states, forces, rows of W, limited rows
  const double *R, *G, *d;          // of x+ = R x + G u + d: (N, n, n), (N, n, inputs), (N, n)
  const double *W, *end, *limited;  // (N, outputs, n), (n, n), (rows, n)
};

// Its matrices: the states after the intervals are by_force U + those without U, the limited rows
// A U + theirs, and the cost is U^T H U + 2 g^T U + ...
struct CondensedProgram {
  std::vector<double> H, A, by_force;
};

CondensedProgram condense(const TickProgram &program);

// Its vectors for changes U of forces u (N, inputs) from a state on: the states x (N, n), the
// limited rows `at`, and g, for the cost |W (x - wanted)|^2 + |end (x_N - wanted_N)|^2.
struct TickVectors {
  std::vector<double> x, g, at;
};

TickVectors renew(const TickProgram &program, const double *by_force, const double *start,
                  const double *u, const double *wanted);

}  // namespace flexura
