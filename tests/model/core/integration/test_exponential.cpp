// Exponential Adams steps: moments against quadrature, exactness on linear robots, order, damping,
// accounts, packs.
#include <cmath>

#include "check.hpp"
#include "integration/exponential/exponential.hpp"
#include "integration/time_loop.hpp"
#include "numbers/eigenproblem.hpp"

using namespace flexura;

namespace {

// One joint and elastic unknowns that its motion shakes: M q'' + damping K q' + K q + cubic q^3 =
// force on the joint.
template <class Real>
struct Shaken : Plant<Real> {
  std::vector<double> M, K;  // (n, n), (n)
  double beta, cubic;

  Shaken(int n, double material, double bend)
      : M(std::size_t(n * n)), K(std::size_t(n)), beta(material), cubic(bend) {
    this->n = n, this->joints = 1, this->first = {0, n}, this->locked = {false};
    this->viscous.assign(1, Real(0.0)), this->coulomb.assign(1, Real(0.0));
    this->lever.assign(std::size_t(n), Real(1.0)), this->deflect = this->lever,
                                                   this->deflect[0] = Real(0.0);
    check::Random random;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j)
        M[std::size_t(i * n + j)] = M[std::size_t(j * n + i)] =
            i == j ? 2.0 + i : random(-0.5, 0.5);
    for (int i = 1; i < n; ++i) K[std::size_t(i)] = std::pow(7.0, i) * 20.0;
  }
  void accelerate(const PassInputs<Real> &p, Real *a, Real *reaction) override {
    const int n = this->n;
    std::vector<double> A = M;
    std::vector<Real> L(std::size_t(n * n)), f(std::size_t(n), Real(0.0));
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) L[std::size_t(i * n + j)] = A[std::size_t(i * n + j)];
      f[std::size_t(i)] = p.force[i] - K[std::size_t(i)] * (p.ys[i] + beta * p.vs[i]) -
                          cubic * K[std::size_t(i)] * p.q[i] * p.q[i] * p.q[i];
    }
    f[0] -= p.stiffness[0] * p.ys[0] + (p.damping[0] + this->viscous[0]) * p.vs[0];
    const Real asked = f[0];
    if (p.held[0]) {
      for (int i = 1; i < n; ++i)
        f[std::size_t(i)] -= M[std::size_t(i * n)] * p.given[0],
            L[std::size_t(i * n)] = L[std::size_t(i)] = 0.0;
      f[0] = p.given[0], L[0] = 1.0;
    }
    cholesky(n, L.data());
    solve_lower(n, L.data(), f.data());
    solve_upper(n, L.data(), f.data());
    for (int i = 0; i < n; ++i) a[i] = f[std::size_t(i)];
    reaction[0] = -asked;
    for (int j = 0; j < n; ++j) reaction[0] += M[std::size_t(j)] * a[j];
    reaction[0] += p.force[0];
  }
  void powers(const Real *q, const Real *v, Real &strain, Real &loss) override {
    strain = loss = Real(0.0);
    for (int i = 0; i < this->n; ++i)
      strain += K[std::size_t(i)] * q[i] * v[i], loss += beta * K[std::size_t(i)] * v[i] * v[i];
  }
  Real energy(const Real *q, const Real *v) override {
    Real sum = 0.0;
    for (int i = 0; i < this->n; ++i) {
      for (int j = 0; j < this->n; ++j) sum += 0.5 * M[std::size_t(i * this->n + j)] * v[i] * v[j];
      sum += 0.5 * K[std::size_t(i)] * q[i] * q[i] * (1.0 + 0.5 * cubic * q[i] * q[i]);
    }
    return sum;
  }
  bool observe(int k, const Real *q, double *out) override {
    out[0] = 0.0;
    for (int i = 1; i < this->n; ++i) out[0] += lane(q[i], k);
    out[1] = 1.0, out[2] = lane(q[0], k) + out[0];
    return true;
  }
  Real fastest(const Real *, const PassInputs<Real> &) override {
    return Real(2.0 * std::sqrt(K.back()));
  }
};

Segment segment(double t0, std::initializer_list<double> c) {
  Segment g{t0, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
  int k = 0;
  for (double x : c) g.c[k++] = x;
  return g;
}

std::vector<double> grid(double end, int rows) {
  std::vector<double> t;
  for (int k = 0; k < rows; ++k) t.push_back(end * k / (rows - 1));
  return t;
}

struct Result {
  Record record;
  long passes, steps, rejected;
  double cutoff;
  Status status;
  const double *row(int k) const {
    return record.state.data() + std::size_t(k) * std::size_t(record.size);
  }
};
Result run(Plant<double> &plant, Inputs &acting, std::vector<double> t, double rtol,
           std::vector<double> q, std::vector<double> v,
           ExponentialOptions options = ExponentialOptions(), double first = 1e-4) {
  Inputs *all[1] = {&acting};
  Loop<double> loop(plant, all, std::move(t), rtol);
  Exponential<double> method(loop.integration, rtol, options);
  loop.start(q.data(), v.data(), first);
  while (loop.advance(method, 1000)) {
  }
  return {loop.record[0],          loop.integration.passes,
          loop.run_state[0].steps, loop.run_state[0].rejected,
          method.cutoff(0),        loop.run_state[0].status};
}
const ExponentialOptions PLAIN{false, 0.05, 0.0};

// What x'' + d2 x' + w2 x = (t/h)^m from rest reaches at h, by 20 000 steps of the midpoint rule on
// the impulse's response.
double response(double w2, double d2, double h, int m, bool rate) {
  double sum = 0.0;
  const int count = 20000;
  for (int k = 0; k < count; ++k) {
    const double x = (k + 0.5) / count;
    double g, dg;
    impulse_response(w2, d2, h * (1.0 - x), g, dg);
    sum += (rate ? dg : g) * std::pow(x, m) * h / count;
  }
  return sum;
}

}  // namespace

TEST(
    "moments of an oscillator agree with quadrature: free, under- and overdamped, strongly "
    "damped") {
  const double h = 0.01;
  for (double turn : {0.0, 0.01, 0.3, 2.9, 3.1, 5.9, 12.0, 40.0})
    for (double drag : {0.0, 0.05, 0.5, 2.0, 2.9, 4.0, 11.0, 60.0}) {
      double w2[4] = {0.0, 0.0, 0.0, 0.0}, d2[4] = {0.0, 0.0, 0.0, 0.0},
             lag[4] = {0.0, 0.0, 0.0, 0.0}, step[16], A[24], B[24];
      w2[1] = turn * turn / (h * h), d2[1] = drag / h;
      propagate(1, 4, w2, d2, lag, h, step, A, B);
      for (int m = 0; m < POWERS; ++m) {
        CHECK_NEAR(A[4 * m + 1] / (h * h), response(w2[1], d2[1], h, m, false) / (h * h), 3e-7);
        CHECK_NEAR(B[4 * m + 1] / h, response(w2[1], d2[1], h, m, true) / h, 3e-6);
      }
      double g, dg;
      impulse_response(w2[1], d2[1], h, g, dg);
      CHECK_NEAR(step[5], g, 1e-15 * h), CHECK_NEAR(step[13], dg, 1e-14);
    }
}

TEST("moments of four alike modes have the bits of single ones") {
  const double h = 0.01;
  double w2[4], d2[4], lag[4] = {1e-4, 0.0, 2e-4, 0.0}, step[16], A[24], B[24];
  for (int k = 0; k < 4; ++k) w2[k] = std::pow(400.0 + 50.0 * k, 2), d2[k] = 3.0 + k;
  propagate(1, 4, w2, d2, lag, h, step, A, B);
  for (int k = 0; k < 4; ++k) {
    double w1[4] = {w2[k], 0.0, 0.0, 0.0}, d1[4] = {d2[k], 0.0, 0.0, 0.0},
           l1[4] = {lag[k], 0.0, 0.0, 0.0}, s1[16], A1[24], B1[24];
    propagate(1, 4, w1, d1, l1, h, s1, A1, B1);
    for (int m = 0; m < POWERS; ++m)
      CHECK(check::same_bits(A[4 * m + k], A1[4 * m]) && check::same_bits(B[4 * m + k], B1[4 * m]));
    for (int r = 0; r < 4; ++r) CHECK(check::same_bits(step[4 * r + k], s1[4 * r]));
  }
}

TEST(
    "a linear robot under a constant force: exact, however fast its modes, in a handful of steps") {
  Shaken<double> plant(6, 2e-5, 0.0);
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, {1.5})};
  const auto result = run(plant, acting, grid(3.0, 61), 1e-3, std::vector<double>(6, 0.0),
                          std::vector<double>(6, 0.0), PLAIN);
  CHECK(result.status == Status::done);
  std::printf("      %ld passes for 3 s; fastest mode turns %.0f rad\n", result.passes,
              3.0 * std::sqrt(plant.K[5] / 7.0));
  CHECK(result.passes < 60);
  std::vector<double> w2(6), shape(36), K(36, 0.0);
  for (int i = 0; i < 6; ++i) K[std::size_t(7 * i)] = plant.K[std::size_t(i)];
  eigen_pencil(6, K.data(), plant.M.data(), w2.data(), shape.data());
  double worst_error = 0.0, balance = 0.0;
  for (int row = 0; row < result.record.rows; ++row) {
    const double t = result.record.t[std::size_t(row)];
    double q[6] = {}, v[6] = {};
    for (int k = 0; k < 6; ++k) {
      const double square = w2[std::size_t(k)] > 1e-4 ? w2[std::size_t(k)] : 0.0,
                   f = 1.5 * shape[std::size_t(k)];
      double g, dg;
      impulse_response(square, 2e-5 * square, t, g, dg);
      const double e = square > 0.0 ? f * (1.0 - dg - 2e-5 * square * g) / square : 0.5 * f * t * t,
                   ed = square > 0.0 ? f * g : f * t;
      for (int i = 0; i < 6; ++i)
        q[i] += e * shape[std::size_t(i * 6 + k)], v[i] += ed * shape[std::size_t(i * 6 + k)];
    }
    for (int i = 0; i < 6; ++i)
      worst_error = std::fmax(worst_error, std::fabs(result.row(row)[i] - q[i])),
      worst_error = std::fmax(worst_error, std::fabs(result.row(row)[6 + i] - v[i]));
    const double *z = result.row(row), energy = plant.energy(z, z + 6);
    balance =
        std::fmax(balance, std::fabs(energy - z[12 + WORK] + z[12 + LOSS] + z[12 + NUMERICAL]));
  }
  const double *end = result.row(result.record.rows - 1);
  std::printf("      error %.1e, balance %.1e of %.3g J (loss %.3g J)\n", worst_error, balance,
              end[12 + WORK], end[12 + LOSS]);
  CHECK_NEAR(worst_error, 0.0, 1e-9);
  CHECK_NEAR(balance, 0.0, 1e-9);
}

TEST(
    "order: halving the tolerance sixfold costs what a method of order six asks for; the balance "
    "follows") {
  Shaken<double> plant(4, 0.0, 0.3);
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, {0.0, 2.0, 0.0, -1.0})};
  const std::vector<double> q{0.0, 0.3, 0.1, 0.01}, v(4, 0.0);
  const auto t = grid(2.0, 41);
  const auto exact = run(plant, acting, t, 1e-11, q, v, PLAIN);
  double passes_before = 0.0;
  for (double rtol : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    const auto result = run(plant, acting, t, rtol, q, v, PLAIN);
    double error = 0.0, balance = 0.0;
    for (int row = 0; row < result.record.rows; ++row) {
      for (int i = 0; i < 4; ++i)
        error = std::fmax(error, std::fabs(result.row(row)[i] - exact.row(row)[i]));
      const double *z = result.row(row), *z0 = result.row(0);
      balance = std::fmax(balance, std::fabs(plant.energy(z, z + 4) - plant.energy(z0, z0 + 4) -
                                             z[8 + WORK] + z[8 + LOSS] + z[8 + NUMERICAL]));
    }
    std::printf(
        "      rtol %.0e: %5ld passes, %ld rejected, error %.1e (%.2f rtol), balance %.1e\n", rtol,
        result.passes, result.rejected, error, error / rtol, balance);
    CHECK(error < 20.0 * rtol);
    CHECK(balance < 40.0 * rtol);
    if (passes_before > 0.0 && rtol < 1e-5) CHECK(double(result.passes) < 1.9 * passes_before);
    passes_before = double(result.passes);
  }
}

namespace {

// The largest gap in the balance of a run, over its rows [J].
double imbalance(Shaken<double> &plant, const Result &result) {
  double worst_gap = 0.0;
  const int n = plant.n;
  const double *z0 = result.row(0), start = plant.energy(z0, z0 + n);
  for (int row = 0; row < result.record.rows; ++row) {
    const double *z = result.row(row), *a = z + 2 * n;
    worst_gap = std::fmax(
        worst_gap, std::fabs(plant.energy(z, z + n) - start - a[WORK] + a[LOSS] + a[NUMERICAL]));
  }
  return worst_gap;
}

}  // namespace

TEST(
    "accounts of a linear robot with gains, friction, material damping and added damping, steps in "
    "which "
    "modes turn many times") {
  Shaken<double> plant(6, 3e-6, 0.0);
  plant.viscous[0] = 0.7;
  Inputs acting(1);
  acting.joints[0].motion = {segment(0.0, {0.4}), segment(1.0, {-0.2})};
  acting.joints[0].kp = 30.0, acting.joints[0].kd = 2.0;
  for (double beta : {0.0, 3e-6, 1e-2}) {  // 1e-2: overdamped modes, which get no more
    plant.beta = beta;
    for (bool damped : {false, true}) {
      const auto result =
          run(plant, acting, grid(2.0, 101), 1e-6, std::vector<double>(6, 0.0),
              std::vector<double>(6, 0.0), ExponentialOptions{damped, 0.05, damped ? 30.0 : 0.0});
      const double *a = result.row(result.record.rows - 1) + 12;
      const double pece_difference = imbalance(plant, result);
      std::printf(
          "      beta %.0e, %s: %ld passes, balance %.1e; work %.4g, loss %.4g, numerical %.3g J\n",
          beta, damped ? "damped" : "plain", result.passes, pece_difference, a[WORK], a[LOSS],
          a[NUMERICAL]);
      CHECK(result.status == Status::done);
      CHECK(pece_difference < 1e-5 * std::fmax(a[WORK], a[LOSS]));
      CHECK(damped && beta < 1e-2 ? a[NUMERICAL] > 0.0 : a[NUMERICAL] == 0.0);
      CHECK(a[LOSS] > 0.1);
    }
  }
}

TEST("Coulomb friction is a loss that closes the balance") {
  Shaken<double> plant(4, 0.0, 0.0);
  plant.coulomb[0] = 0.2, plant.slow = 0.2;
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, {2.0}), segment(0.7, {-1.0})};
  const auto result = run(plant, acting, grid(1.5, 31), 1e-6, std::vector<double>(4, 0.0),
                          std::vector<double>(4, 0.0), PLAIN);
  const double *a = result.row(result.record.rows - 1) + 8;
  std::printf("      %ld passes, balance %.1e; work %.4g, loss %.4g J\n", result.passes,
              imbalance(plant, result), a[WORK], a[LOSS]);
  CHECK(imbalance(plant, result) < 2e-5 * a[WORK]);
}

TEST(
    "added damping acts about the quasi-static motion: slow motion is unchanged, ringing dies at "
    "zeta w") {
  Shaken<double> plant(4, 0.0, 0.0);
  Inputs acting(1);
  acting.joints[0].force = {segment(0.0, {0.0, 0.0, 0.0, 10.0, -15.0, 6.0}),
                            segment(1.0, {1.0})};  // rises in 1 s
  const std::vector<double> zero(4, 0.0);
  const auto plain = run(plant, acting, grid(2.0, 41), 1e-8, zero, zero, PLAIN);
  const auto damped = run(plant, acting, grid(2.0, 41), 1e-8, zero, zero,
                          ExponentialOptions{true, 0.2, 0.5 * std::sqrt(plant.K[2] / 4.0)});
  double difference = 0.0, size = 0.0;
  for (int row = 0; row < plain.record.rows; ++row)
    for (int i = 1; i < 4; ++i)
      difference = std::fmax(difference, std::fabs(plain.row(row)[i] - damped.row(row)[i])),
      size = std::fmax(size, std::fabs(plain.row(row)[i]));
  std::printf("      difference %.1e of %.2g\n", difference, size);
  CHECK(difference < 2e-3 * size);
  const std::vector<double> bent{0.0, 0.0, 0.0, 0.01};
  Inputs free(1);
  const double w = std::sqrt(plant.K[3] / 5.0);
  const auto ringing = run(plant, free, {0.0, 20.0 / w, 60.0 / w}, 1e-8, bent, zero,
                           ExponentialOptions{true, 0.02, 0.5 * w});
  double energy[3];
  for (int row = 0; row < 3; ++row)
    energy[row] = plant.energy(ringing.row(row), ringing.row(row) + 4);
  std::printf("      energy %.3e %.3e %.3e, numerical %.3e\n", energy[0], energy[1], energy[2],
              ringing.row(2)[8 + NUMERICAL]);
  CHECK(energy[2] < 0.2 * energy[0]);
  CHECK_NEAR(energy[0] - energy[2], ringing.row(2)[8 + NUMERICAL], 1e-9 * energy[0]);
}

TEST("the cutoff: lower for loose tolerances, above harmonic forces, none for robots at rest") {
  Shaken<double> plant(6, 0.0, 0.0);
  Inputs acting(1), still(1);
  acting.joints[0].force = {segment(0.0, {1.0})};
  const std::vector<double> zero(6, 0.0);
  double before = 0.0;
  for (double rtol : {1e-2, 1e-3, 1e-4, 1e-5}) {
    const double cutoff = run(plant, acting, grid(0.01, 2), rtol, zero, zero).cutoff;
    CHECK(cutoff >= before);
    before = cutoff;
  }
  Inputs humming = acting;
  humming.joints[0].force[0].A = 0.1, humming.joints[0].force[0].w = 50.0;
  CHECK(run(plant, humming, grid(0.01, 2), 1e-2, zero, zero).cutoff >= 250.0);
  CHECK(std::isinf(run(plant, still, grid(0.01, 2), 1e-2, zero, zero).cutoff));
}

TEST("four robots in a pack, each with its own steps, have the bits of single ones") {
  const auto t = grid(1.5, 31);
  for (double beta : {1e-5, 1e-2}) {  // with 1e-2 some modes are damped strongly
    Shaken<Pack<4>> four(5, beta, 0.3);
    Inputs acting[4] = {Inputs(1), Inputs(1), Inputs(1), Inputs(1)};
    Inputs *all[4];
    for (int k = 0; k < 4; ++k) {
      acting[k].joints[0].force = {segment(0.0, {0.5 + 0.3 * k, 0.1}),
                                   segment(0.4 + 0.1 * k, {-0.5})};
      acting[k].joints[0].motion = {segment(0.0, {0.1 * k})}, acting[k].joints[0].kp = 2.0 + k,
      acting[k].joints[0].kd = 0.1 * k;
      if (k == 3) acting[k].high[0] = 0.4;  // is met on the way
      all[k] = &acting[k];
    }
    const double rtol = 1e-4;
    Loop<Pack<4>> loop(four, all, t, rtol);
    Exponential<Pack<4>> method(loop.integration, rtol, ExponentialOptions{true, 0.05, 60.0});
    std::vector<Pack<4>> q(5, Pack<4>(0.0)), v(5, Pack<4>(0.0));
    for (int k = 0; k < 4; ++k) q[2].set(k, 0.02 * k);
    loop.start(q.data(), v.data(), 1e-4);
    while (loop.advance(method, 1000)) {
    }
    for (int k = 0; k < 4; ++k) {
      Shaken<double> one(5, beta, 0.3);
      std::vector<double> q1(5, 0.0);
      q1[2] = 0.02 * k;
      const auto single = run(one, acting[k], t, rtol, q1, std::vector<double>(5, 0.0),
                              ExponentialOptions{true, 0.05, 60.0});
      CHECK(single.steps == loop.run_state[std::size_t(k)].steps);
      const Record &packed = loop.record[std::size_t(k)];
      CHECK(packed.rows == single.record.rows && packed.state.size() == single.record.state.size());
      int different = 0;
      for (std::size_t i = 0; i < std::size_t(packed.rows * packed.size); ++i)
        different += packed.state[i] != single.record.state[i];
      std::printf("      robot %d: %ld steps, %d of %d numbers differ\n", k, single.steps,
                  different, packed.rows * packed.size);
      CHECK(different == 0);
    }
  }
}

TEST("a locked and a prescribed joint: the motion is followed, the balance closes") {
  Shaken<double> plant(4, 1e-4, 0.0);
  plant.locked[0] = true;
  Inputs acting(1);
  const auto locked = run(plant, acting, grid(1.0, 21), 1e-6, {0.3, 0.1, 0.0, 0.0},
                          std::vector<double>(4, 0.0), PLAIN);
  CHECK(locked.status == Status::done);
  for (int row = 0; row < locked.record.rows; ++row) CHECK(locked.row(row)[0] == 0.3);
}

TEST("the cutoff goes by the shares of the highest modes, down to the last that bends") {
  const double infinite = std::numeric_limits<double>::infinity(), all[3] = {1.0, 4.0, 9.0},
               free[3] = {0.0, 4.0, 9.0}, none[3] = {0.0, 0.0, 0.0}, some[3] = {0.0, 1.0, 0.0};
  CHECK_NEAR(cutoff_of(3, all, none, 1e-3, 0.0), 1.0, 2e-6);
  CHECK_NEAR(cutoff_of(3, free, none, 1e-3, 0.0), 2.0, 4e-6);
  CHECK_NEAR(cutoff_of(3, all, some, 1e-3, 0.0), 3.0, 6e-6);
  CHECK_NEAR(cutoff_of(3, all, none, 1e-3, 7.0), 35.0, 0.0);
  const double last[3] = {0.0, 0.0, 1.0};
  CHECK(cutoff_of(3, all, last, 1e-3, 0.0) == infinite);
}

TEST("gains of a rate alone feed back as those of a place do; a motion without one is none") {
  const std::vector<double> zero(6, 0.0);
  auto cutoff = [&](double kp, double kd, bool prescribed) {
    Shaken<double> plant(6, 0.0, 0.0);
    Inputs acting(1);
    acting.joints[0].force = {segment(0.0, {1.0})};
    acting.joints[0].kp = kp, acting.joints[0].kd = kd, acting.joints[0].prescribed = prescribed;
    return run(plant, acting, grid(3.0, 2), 0.3, zero, zero).cutoff;
  };
  CHECK(cutoff(0.0, 1e-9, false) == cutoff(1e-9, 0.0, false));
  CHECK(cutoff(0.0, 1e-9, false) > cutoff(0.0, 0.0, false));
  CHECK(cutoff(0.0, 0.0, true) == cutoff(0.0, 0.0, false));
}

TEST("what is not a number ends a run by exponential steps where it is") {
  for (double force : {std::nan(""), std::numeric_limits<double>::infinity(), 1e305}) {
    Shaken<double> plant(4, 0.0, 0.0);
    Inputs acting(1);
    acting.function = [force](double t, const double *, const double *, double *out) {
      out[0] = t > 0.5 ? force : 1.0;
    };
    const std::vector<double> zero(4, 0.0);
    const auto result = run(plant, acting, grid(1.0, 11), 1e-6, zero, zero, PLAIN);
    CHECK(result.status == Status::diverged || result.status == Status::stuck);
    CHECK(result.record.rows >= 5 && result.record.rows <= 6);
    for (int row = 0; row < result.record.rows; ++row)
      for (int i = 0; i < 8; ++i) CHECK(std::isfinite(result.row(row)[i]));
  }
}

namespace {

// A controller that holds a force in turns, which a joint on its motion does not feel.
struct Turns : Sampler {
  double force = 0.0;
  void tick(long k, double, const double *, const double *, SampledOutput &held) override {
    held.force[0] = k % 2 ? force : 0.0;
  }
};

}  // namespace

TEST("ticks at which nothing changes leave the motion as it is, beside a joint on its motion too") {
  for (bool given : {false, true}) {
    std::vector<std::vector<double>> ends;
    for (bool ticks : {false, true}) {
      Shaken<double> plant(4, 1e-4, 0.3);
      Turns turns;
      turns.force = given ? 1.0 : 0.0;
      Inputs acting(1);
      acting.joints[0].motion = {segment(0.0, {0.0, 0.0, 0.3, -0.1})};
      acting.joints[0].prescribed = given, acting.joints[0].kp = 40.0;
      if (ticks) acting.sampler = &turns, acting.rate_Hz = 50.0;
      const auto result = run(plant, acting, grid(1.0, 11), 1e-7, {0.0, 0.02, 0.0, 0.0},
                              std::vector<double>(4, 0.0), PLAIN);
      CHECK(result.status == Status::done);
      ends.emplace_back(result.row(10), result.row(10) + 8);
    }
    for (std::size_t i = 0; i < 8; ++i) CHECK_NEAR(ends[0][i], ends[1][i], 2e-6);
    if (given) CHECK_NEAR(ends[1][0], 0.2, 1e-12);
  }
}
