// Copies of one robot that take the same number of equal steps under forces that are held: what a
// learner does with thousands of them between two actions.
//
// Four share a pack, and threads share the packs. A copy's digits depend on nothing but itself.
#pragma once
#include <memory>
#include <vector>

#include "robot/model.hpp"

namespace flexura {

class Copies {
 public:
  explicit Copies(std::shared_ptr<const Model<double>> robot);

  int unknowns() const { return single_->n; }
  int joints() const { return single_->links(); }
  const std::vector<int> &bending() const { return bending_; }  // links that bend

  // So many of them, each a row; all arrays are the caller's.
  struct States {
    int count;
    double *q, *v;             // (count, n); a copy that does not get there keeps its own
    const double *force;       // (count, joints) [N m or N]
    const double *low, *high;  // (joints) limits [m or rad]
    const bool *moves;         // (count) the others stay where they are
    double *deflection;        // (count, links that bend) of the tips [m]
    double *tip;               // (count, 2) x, y [m]
    bool *arrived;  // (count): no limit was passed at the end of a step, and the state is finite
  };

  // `steps` steps of the length `step_s` (86), and what is seen at their end.
  void advance(const States &states, double step_s, int steps, int threads) const;

 private:
  std::shared_ptr<const Model<double>> single_;
  Model<Pack<4>> four_;
  std::vector<int> bending_;

  class Worker;
};

}  // namespace flexura
