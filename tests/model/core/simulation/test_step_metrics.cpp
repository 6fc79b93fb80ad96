// Figures of controlled motions (80): formulas, motions that never arrive, lower bounds on the way.
#include "simulation/step_metrics.hpp"

#include <cmath>
#include <vector>

#include "check.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

Numbers grid(double end, int count) {
  Numbers t;
  for (int k = 0; k < count; ++k) t.push_back(end * k / (count - 1));
  return t;
}
Samples samples(const Numbers &t) { return {t.data(), int(t.size())}; }

struct Figures {
  double of[JOINT_FIGURES] = {};
  Figures(const Numbers &t, const Numbers &q, double wanted) {
    const Numbers r(t.size(), wanted);
    joint_metrics(samples(t), r.data(), q.data(), of);
  }
};

}  // namespace

TEST("a motion that never arrives has no rise and does not settle; one on the way has half of it") {
  const Numbers t = grid(1.0, 11);
  const Figures still(t, Numbers(11, 0.0), 1.0);
  CHECK(std::isnan(still.of[RISE]) && std::isnan(still.of[SETTLING]));
  CHECK(still.of[OVERSHOOT] == 0.0 && still.of[ERROR] == 1.0);
  CHECK_NEAR(still.of[ITAE], 0.5, 1e-12);  // int t dt
  Numbers half(11);
  for (std::size_t k = 0; k < 11; ++k) half[k] = 0.5 * t[k];
  CHECK(std::isnan(Figures(t, half, 1.0).of[RISE]));
}

TEST("a motion that leaves the band again settles when it is back for good") {
  const Numbers t{0.0, 1.0, 2.0, 3.0, 4.0, 5.0}, q{0.0, 1.0, 1.1, 1.0, 1.0, 1.0};
  const Figures found(t, q, 1.0);
  CHECK_NEAR(found.of[SETTLING], 2.8, 1e-12);  // 1.1 falls through 1.02
  CHECK_NEAR(found.of[OVERSHOOT], 0.1, 1e-12);
  CHECK_NEAR(found.of[RISE], 0.8, 1e-12);
  const Numbers away{0.0, 1.0, 1.0, 1.0, 1.0, 1.1};
  CHECK(std::isnan(Figures(t, away, 1.0).of[SETTLING]));
}

TEST("a strip's residual is looked for from where the joints have settled, a fifth at the latest") {
  const Numbers t = grid(10.0, 101);
  Numbers w(101, 0.0);
  w[10] = 0.3, w[90] = -0.1;
  for (const auto &[settled, residual] : {std::pair{0.0, 0.2}, std::pair{5.0, 0.05},
                                          std::pair{9.5, 0.05}, std::pair{std::nan(""), 0.05}}) {
    double out[STRIP_FIGURES] = {};
    strip_metrics(samples(t), w.data(), settled, out);
    CHECK_NEAR(out[RESIDUAL], residual, 1e-12);
    CHECK_NEAR(out[PEAK], 0.3, 1e-12);
  }
}

TEST("what a motion costs so far is what it costs in the end, bit by bit") {
  const Numbers t = grid(1.0, 50);
  Numbers q(50), r(50, 1.0);
  for (std::size_t k = 0; k < 50; ++k) q[k] = 1.0 - std::cos(9.0 * t[k]);
  double whole[JOINT_FIGURES] = {}, parts[JOINT_FIGURES] = {};
  joint_metrics(samples(t), r.data(), q.data(), whole);
  for (int from : {0, 20, 21, 50})
    joint_so_far(samples(t), r.data(), q.data(), from,
                 from == 0    ? 20
                 : from == 20 ? 21
                              : 50,
                 parts);
  CHECK_NEAR(parts[ITAE], whole[ITAE], 1e-12 * whole[ITAE]);
  CHECK_NEAR(parts[OVERSHOOT], whole[OVERSHOOT], 1e-12);
}

TEST("a vibration's lower bound tells whether it is more than enough, and is never above it") {
  check::Random random{3};
  for (int trial = 0; trial < 200; ++trial) {
    const int count = 40, seen = trial % 4 == 0 ? count : int(random(3.0, count));
    const Numbers t = grid(2.0, count);
    Numbers w(std::size_t(count), 0.0);
    for (double &x : w) x = random(-1.0, 1.0) * random(0.0, 1.0);
    double least = 1e300;  // about whatever place it ends
    for (int place = 0; place < seen; ++place) {
      double sum = 0.0;
      for (std::size_t k = 1; k < std::size_t(seen); ++k)
        sum += 0.5 * (t[k] - t[k - 1]) *
               (t[k] * std::fabs(w[k] - w[std::size_t(place)]) +
                t[k - 1] * std::fabs(w[k - 1] - w[std::size_t(place)]));
      least = std::fmin(least, sum);
    }
    for (double part : {0.01, 0.5, 0.99, 1.01, 2.0}) {
      const double bound = vibration_lower_bound(samples(t), w.data(), seen, part * least);
      CHECK(0.0 <= bound && bound <= least * (1.0 + 1e-12));
      CHECK((bound > part * least) == (part < 1.0));
    }
    // as near as cannot be told: close to it
    const double near = vibration_lower_bound(samples(t), w.data(), seen, (1.0 - 1e-6) * least);
    CHECK(0.998 * least <= near && near <= least * (1.0 + 1e-12));
  }
}

TEST("nothing seen, one instant, and a strip that stays where it is cost nothing") {
  const Numbers t = grid(1.0, 10), flat(10, 0.2);
  Numbers w(10, 0.0);
  w[1] = 1.0;
  CHECK(vibration_lower_bound(samples(t), w.data(), 0, 1.0) == 0.0);
  CHECK(vibration_lower_bound(samples(t), w.data(), 1, 1.0) == 0.0);
  CHECK(vibration_lower_bound(samples(t), flat.data(), 10, 1.0) == 0.0);
  const Numbers once(10, 0.0);  // no time passes: nothing has a weight
  CHECK(vibration_lower_bound(samples(once), w.data(), 10, 1.0) == 0.0);
}
