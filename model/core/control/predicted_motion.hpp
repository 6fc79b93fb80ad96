// The motion ahead of a predictive controller: its intervals linearised (129), and the program of a
// tick with the states eliminated (130).
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
  const double *x, *u, *start;      // the motion (N + 1, n), its forces (N, inputs), dx_0 (n)
  const double *wanted;             // what the states after the intervals are to be (N, n)
  const double *W, *end, *limited;  // (N, outputs, n), (n, n), (rows, n)
};

// Its matrices: |W (x + dx - wanted)|^2 + |end (x_N + dx_N - wanted_N)|^2 = U^T H U + 2 g^T U + ...
// with dx = by_force U + moved; the limited rows are A U + at.
struct CondensedProgram {
  std::vector<double> H, g, A, at, by_force, moved;
};

CondensedProgram condense(const TickProgram &program);

}  // namespace flexura
