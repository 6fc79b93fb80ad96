// The motion ahead of a predictive controller: its intervals, and the program without its states.
#include "control/predicted_motion.hpp"

#include "check.hpp"
#include "dynamics/forward_dynamics.hpp"
#include "link/assembly.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

std::shared_ptr<const Model<double>> two_links() {
  Robot robot;
  for (int i = 0; i < 2; ++i) {
    Link link;
    link.length = 0.5, link.elements = 1;
    Interval all;
    all.to = 0.5, all.mass[0] = 0.2, all.stiffness[0] = 1.0;
    link.material = {all};
    link.joint.hub_inertia = 1e-2;
    robot.links.push_back(link);
  }
  return std::make_shared<const Model<double>>(assemble(robot));
}

Numbers some(std::size_t count, double size, check::Random &random) {
  Numbers out(count);
  for (double &x : out) x = random(-size, size);
  return out;
}

}  // namespace

TEST("elimination with pivots solves a system whose first pivot is 0") {
  Numbers A{0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 4.0, 0.0, -1.0}, B{7.0, 1.0, 6.0, 1.0, 1.0, 1.0};
  eliminate_dense(A, B, 3, 2);  // x = 1, 2, 3 in the first column
  for (int i = 0; i < 3; ++i) CHECK_NEAR(B[2 * i], i + 1.0, 1e-14);
  CHECK_NEAR(2.0 * B[3] + B[5], 1.0, 1e-14);
}

TEST("an interval has the motion's accelerations, and follows the equations for short times") {
  const auto model = two_links();
  const int m = model->n, n = 2 * m;
  std::vector<int> free;
  for (int i = 0; i < m; ++i) free.push_back(i);
  PredictedMotion motion(model, free, {model->first[0], model->first[1]});
  check::Random random;
  const Numbers x = some(n, 0.1, random), u = some(2, 1.0, random);
  Numbers force(m, 0.0), expected(m), a(m, 0.0), R(n * n), G(n * 2), d(n);
  force[model->first[0]] = u[0], force[model->first[1]] = u[1];
  Workspace<double> work(*model);
  accelerate(*model, work, x.data(), x.data() + m, force.data(), expected.data());
  const double h = 1e-6;
  motion.step(x.data(), u.data(), a.data(), h, R.data(), G.data(), d.data());
  for (int i = 0; i < m; ++i) {
    CHECK_NEAR(a[i], expected[i], 1e-8 * (1 + std::fabs(expected[i])));
    double place = d[i], rate = d[m + i];
    for (int k = 0; k < n; ++k) place += R[i * n + k] * x[k], rate += R[(m + i) * n + k] * x[k];
    for (int j = 0; j < 2; ++j) place += G[i * 2 + j] * u[j], rate += G[(m + i) * 2 + j] * u[j];
    CHECK_NEAR(place, x[i] + h * x[m + i], 1e-7);
    CHECK_NEAR(rate, x[m + i] + h * expected[i], 1e-3 * h * (1e3 + std::fabs(expected[i])));
  }
}

TEST("a program without its states is that with them") {
  check::Random random;
  for (int n : {3, 4, 6}) {
    const int N = 3, p = 2, outputs = 3, rows = 1, V = N * p;
    const Numbers R = some(N * n * n, 1.0, random), G = some(N * n * p, 1.0, random),
                  d = some(N * n, 1.0, random), u = some(V, 1.0, random),
                  start = some(n, 1.0, random), wanted = some(N * n, 1.0, random),
                  W = some(N * outputs * n, 1.0, random), end = some(n * n, 1.0, random),
                  limited = some(n, 1.0, random), U = some(V, 1.0, random);
    TickProgram program;
    program.N = N, program.n = n, program.inputs = p, program.outputs = outputs,
    program.rows = rows;
    program.R = R.data(), program.G = G.data(), program.d = d.data();
    program.W = W.data(), program.end = end.data(), program.limited = limited.data();
    const CondensedProgram found = condense(program);
    const TickVectors of =
        renew(program, found.by_force.data(), start.data(), u.data(), wanted.data());
    // the states under u + U, and what they cost, against the same with U = 0
    auto cost = [&](const Numbers &more, bool compare) {
      Numbers now = start;
      double sum = 0.0;
      for (int k = 0; k < N; ++k) {
        Numbers next(n);
        for (int i = 0; i < n; ++i) {
          next[i] = d[k * n + i];
          for (int l = 0; l < n; ++l) next[i] += R[(k * n + i) * n + l] * now[l];
          for (int j = 0; j < p; ++j)
            next[i] += G[(k * n + i) * p + j] * (u[k * p + j] + more[k * p + j]);
        }
        now = next;
        double shown = 0.0, row = of.at[k];
        for (int i = 0; i < n; ++i) {
          shown += limited[i] * now[i];
          double state = of.x[k * n + i];
          for (int j = 0; j < V; ++j) state += found.by_force[(k * n + i) * V + j] * more[j];
          if (compare) CHECK_NEAR(state, now[i], 1e-12 * (1 + std::fabs(now[i])));
        }
        for (int j = 0; j < V; ++j) row += found.A[k * V + j] * more[j];
        if (compare) CHECK_NEAR(row, shown, 1e-12 * (1 + std::fabs(shown)));
        auto pay = [&](const double *weights, int count) {
          for (int o = 0; o < count; ++o) {
            double off = 0.0;
            for (int i = 0; i < n; ++i) off += weights[o * n + i] * (now[i] - wanted[k * n + i]);
            sum += off * off;
          }
        };
        pay(W.data() + k * outputs * n, outputs);
        if (k + 1 == N) pay(end.data(), n);
      }
      return sum;
    };
    double quadratic = 0.0;
    for (int i = 0; i < V; ++i) {
      quadratic += 2.0 * of.g[i] * U[i];
      for (int j = 0; j < V; ++j) quadratic += U[i] * found.H[i * V + j] * U[j];
    }
    const double more = cost(U, true) - cost(Numbers(V, 0.0), true);
    CHECK_NEAR(quadratic, more, 1e-11 * (1 + std::fabs(more)));
  }
}
