// One robot under many controllers: each row of gains is a run from the same start, of which only
// its figures (step_metrics.hpp) are kept.
//
// A row may have a limit to its cost, sum_k price_k max(0, figure_k - free_k) with prices on
// overshoot, ITAE, effort and vibration: it is given up as soon as it is certain to cost more. What
// a row gives does not depend on the others, nor on threads.
#pragma once
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "control/controller.hpp"
#include "control/model_plant.hpp"
#include "simulation/step_metrics.hpp"

namespace flexura {

// What a figure costs; (figures) each.
struct Prices {
  const double *price, *free;
};

// What all rows have in common.
struct Plan {
  std::shared_ptr<const Model<double>> robot;
  Inputs acting;  // drives of joints that are not the controller's, loads on links, limits
  Controller controller;
  std::vector<double> t;          // of the samples, from the start to the end, on ticks
  std::vector<double> start;      // (n) at rest
  std::vector<double> reference;  // (N, T) of each joint, before any filter
  double rtol;
  std::string method;  // of `make_method`, or "auto": each run selects its own

  int joints() const { return robot->links(); }
  int figures() const { return JOINT_FIGURES * joints() + STRIP_FIGURES; }
};

class Trial;

class GainSweep {
 public:
  explicit GainSweep(Plan plan);
  ~GainSweep();

  // Runs with gains (rows, N, GAINS) and limits (rows) of the cost, infinite for none, by so many
  // threads: figures (rows, figures), and what fraction of the time each reached (rows), below 1
  // where it failed or was given up. Of a row that was given up the figures are lower bounds, 0
  // where it has none; of one that failed they are no numbers. May be called from several threads
  // at once.
  void run(const Prices &prices, const double *gains, const double *limits, int rows, int threads,
           double *figures, double *reached);

  const Plan &plan() const { return plan_; }

 private:
  Plan plan_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Trial>> idle_;  // memories of runs

  std::unique_ptr<Trial> lend();
  void take_back(std::unique_ptr<Trial> trial);
};

}  // namespace flexura
