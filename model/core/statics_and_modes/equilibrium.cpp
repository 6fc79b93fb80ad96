// Newton's method with load steps (equilibrium.hpp).
#include "statics_and_modes/equilibrium.hpp"

#include <algorithm>
#include <cmath>

namespace flexura {
namespace {

using Numbers = std::vector<double>;
constexpr double DONE = 1e-8;  // rad: after a Newton step as small as that the error is its square
constexpr double SMALL =
    1e-3;  // rad: where V has too few digits to judge a step, and Newton's method needs no judge
constexpr int MOST_SWEEPS = 40;      // of one load
constexpr double LEAST_STEP = 1e-6;  // of the load: how closely the load that is lost is found

struct Search {
  bool found = false,
       falls = false;  // falls: V was not at a minimum in every direction, somewhere on the way
  int sweeps = 0;
  double residual = 0.0;
};

// Newton's method from q for one load. With `descend`, on where V falls in some direction: to a
// minimum, wherever it is.
Search newton(ChainAtRest &still, const TipLoad &load, double share, bool descend, Numbers &q) {
  Search out;
  const std::size_t n = q.size();
  Numbers slope(n), step(n), trial(n);
  double size, V = still.energy(q.data(), load, share, size);
  const int most = descend ? 20 * MOST_SWEEPS : MOST_SWEEPS;
  while (std::isfinite(V) && out.sweeps++ < most) {
    const int wrong = still.tangent(load, share, 0.0, descend);
    out.falls = wrong > 0;
    if (wrong > 0 && !descend) return out;
    still.gradient(q.data(), load, share, slope.data());
    still.solve(slope.data(), step.data());
    double fall = 0.0;
    for (std::size_t i = 0; i < n; ++i) step[i] = -step[i], fall += slope[i] * step[i];
    out.residual = still.largest_turn(step.data());
    if (!(out.residual < 1e6)) return out;
    if (out.residual < SMALL && wrong == 0) {
      for (std::size_t i = 0; i < n; ++i) q[i] += step[i];
      V = still.energy(q.data(), load, share, size);
      if (out.residual < DONE) {
        out.found = true;
        return out;
      }
      continue;
    }
    if (fall == 0.0) {  // in balance at a place that is no minimum
      out.found = wrong == 0;
      return out;
    }
    double length = descend ? std::min(1.0, 1.0 / out.residual) : 1.0, trial_V = V;
    for (int halvings = 0; halvings < 30;
         ++halvings, length *= 0.5) {  // V falls by a tenth of what the tangent says, or more
      for (std::size_t i = 0; i < n; ++i) trial[i] = q[i] + length * step[i];
      trial_V = still.energy(trial.data(), load, share, size);
      if (trial_V - V <= 0.1 * length * (1.0 - 0.5 * length) * fall + 1e-15 * size) break;
    }
    q = trial, V = trial_V;
  }
  return out;
}

}  // namespace

Equilibrium equilibrium(const Model<double> &model, double *q, const TipLoad &load,
                        const char *free) {
  Equilibrium out;
  const std::size_t n = std::size_t(model.n);
  ChainAtRest still(model, q, free);
  const bool turns = free && std::any_of(free, free + model.links(), [](char f) { return f != 0; });
  Numbers here(q, q + n), trial(here), rest(here), before;
  for (const Piece<double> &c : model.pieces) std::fill_n(rest.begin() + c.own(), c.m, 0.0);
  double before_share = 0.0;
  auto finish = [&](Balance balance, double share, const Numbers &found) {
    double size;
    still.energy(found.data(), load, share, size);
    out.balance = balance, out.share = share, out.tip = still.tip();
    std::copy(found.begin(), found.end(), q);
    return out;
  };
  if (turns ||
      here != rest) {  // a free joint has no place without load; a guess is tried as it stands
    const Search search = newton(still, load, 1.0, turns, trial);
    out.sweeps += search.sweeps, out.residual = search.residual;
    if (search.found) return finish(Balance::stable, 1.0, trial);
    if (turns) return finish(search.falls ? Balance::unstable : Balance::missing, 1.0, trial);
  }
  here = rest;
  double share = 0.0, increase = 1.0;
  bool falls = false;
  while (share < 1.0) {
    const double next = share + increase < 1.0 ? share + increase : 1.0;
    trial = here;
    if (!before.empty())  // on along the line through the last two
      for (std::size_t i = 0; i < n; ++i)
        trial[i] += (here[i] - before[i]) * ((next - share) / (share - before_share));
    const Search search = newton(still, load, next, false, trial);
    out.sweeps += search.sweeps;
    if (search.found) {
      before = here, before_share = share;
      here = trial, share = next, out.residual = search.residual;
      if (search.sweeps <= 8) increase *= 2.0;
      continue;
    }
    falls = search.falls;
    increase = 0.5 * (next - share);
    if (increase < LEAST_STEP)
      return finish(falls ? Balance::unstable : Balance::missing, share, here);
  }
  return finish(Balance::stable, 1.0, here);
}

}  // namespace flexura
