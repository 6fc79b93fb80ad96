// M, K, frequencies and modes: positivity at any bending, exact frequencies, free and massless
// directions, many unknowns.
#include "statics_and_modes/natural_modes.hpp"

#include "check.hpp"
#include "dynamics/inverse_dynamics.hpp"
#include "dynamics/piece/mass_proportional_damping.hpp"
#include "dynamics/places/energies.hpp"
#include "link/assembly.hpp"
#include "numbers/eigenproblem.hpp"
#include "statics_and_modes/equilibrium.hpp"
#include "statics_and_modes/linearization.hpp"

using namespace flexura;
using Numbers = std::vector<double>;

namespace {

constexpr double pi = 3.14159265358979324;

Link strip(double length, double mass, double stiffness, int elements) {
  Link link;
  link.length = length, link.elements = elements;
  Interval all;
  all.to = length, all.mass[0] = mass, all.stiffness[0] = stiffness;
  link.material = {all};
  return link;
}

Model<double> cantilever(int elements, double mass = 1.0, double stiffness = 1.0) {
  Robot robot;
  robot.links = {strip(1.0, mass, stiffness, elements)};
  return assemble(robot);
}

// R, Pa, Pb, rigid and modal links, one of each.
Robot mixed() {
  Robot robot;
  robot.gravity[0] = 1.0, robot.gravity[1] = -6.0;
  Link slender = strip(0.5, 0.4, 2.0, 3), rider = strip(0.4, 0.2, 1.0, 2),
       sleeved = strip(0.6, 0.3, 1.5, 2), few = strip(0.3, 0.2, 0.4, 4), rigid;
  rider.joint.kind = JointKind::slider, rider.joint.angle = 1.1, rider.joint.hub_mass = 0.2,
  rider.joint.hub_inertia = 1e-4;
  sleeved.joint.kind = JointKind::sleeve, sleeved.joint.angle = -0.6, sleeved.joint.start = 0.4,
  sleeved.joint.hub_mass = 0.1;
  few.modes = 2, few.beta = 1e-3, few.joint.viscous = 0.02;
  slender.lumps = {{0.2, 0.05, 1e-4}};
  rigid.length = 0.2, rigid.mass = 0.3, rigid.centre = 0.1, rigid.inertia = 1e-3;
  robot.links = {slender, rider, sleeved, rigid, few};
  robot.payload_mass = 0.1, robot.payload_inertia = 1e-4;
  return robot;
}

Numbers bent(const Model<double> &model, double most, check::Random &random) {
  Numbers q(model.n);
  for (double &x : q) x = random(-most, most);
  for (int i = 0; i < model.links(); ++i)
    if (model.kind[i] != JointKind::revolute) q[model.first[i]] = random(0.2, 0.35);
  return q;
}

double definiteness(int n, Numbers M) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (i != j) M[i * n + j] /= std::sqrt(M[i * n + i] * M[j * n + j]);
  for (int i = 0; i < n; ++i) M[i * n + i] = 1.0;
  return cholesky(n, M.data());
}

// One link with damping alpha, and a payload; of each kind of link one.
std::vector<Robot> damped(double alpha) {
  std::vector<Robot> out;
  for (int kind = 0; kind < 6; ++kind) {
    Robot robot;
    Link link = strip(0.5, 0.4, 2.0, 3);
    link.alpha = alpha;
    robot.payload_mass = 0.1, robot.payload_inertia = 2e-3;
    if (kind == 1) link.modes = 2;
    if (kind == 2 || kind == 5)
      link.joint.kind = JointKind::sleeve, link.joint.start = 0.35, link.joint.hub_mass = 0.1;
    if (kind == 3) link.lumps = {{0.2, 0.05, 1e-3}, {0.5, 0.02, 0.0}};
    if (kind >= 4)
      robot.payload_off_tip = true, robot.payload_along = 0.04, robot.payload_across = -0.02;
    robot.links = {link};
    out.push_back(robot);
  }
  return out;
}

}  // namespace

TEST("M is positive definite at any bending, with a bare hub; v.M v / 2 is the kinetic energy") {
  check::Random random;
  for (int elements : {1, 4, 16})
    for (double slope : {0.0, 0.1, 1.0, 3.0}) {
      const Model<double> model = cantilever(elements);
      const Numbers q = bent(model, slope, random);
      Numbers M(model.n * model.n);
      mass_matrix(model, q.data(), M.data());
      CHECK(definiteness(model.n, M) > 0.0);
    }
  const Model<double> model = assemble(mixed());
  const int n = model.n;
  for (int k = 0; k < 10; ++k) {
    const Numbers q = bent(model, 0.7, random), v = bent(model, 1.0, random);
    Numbers M(n * n);
    mass_matrix(model, q.data(), M.data());
    CHECK(definiteness(n, M) > 0.0);
    Workspace<double> sweep(model);
    Numbers unit(n, 0.0), still(n, 0.0), column(n);
    for (int k = 0; k < n; ++k) {  // by inverse dynamics, column by column
      unit[k] = 1.0;
      forces(model, sweep, q.data(), still.data(), unit.data(), Terms{false, false, false},
             column.data());
      unit[k] = 0.0;
      for (int i = 0; i < n; ++i)
        CHECK_NEAR(M[i * n + k], column[i], 1e-13 * std::sqrt(M[i * n + i] * M[k * n + k]));
    }
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) sum += 0.5 * v[i] * M[i * n + j] * v[j];
    Workspace<double> work(model);
    CHECK_NEAR(energies(model, work, q.data(), v.data()).kinetic, sum, 1e-13 * sum);
  }
}

TEST(
    "K is symmetric, and the derivative of the static forces and of the gradient of V; all kinds "
    "of joints "
    "and links") {
  check::Random random;
  const Model<double> model = assemble(mixed());
  const int n = model.n;
  TipLoad load;
  load.force[0] = 0.3, load.force[1] = -0.7, load.moment = 0.2;
  for (int k = 0; k < 5; ++k) {
    Numbers q = bent(model, 0.7, random), K(n * n), zero(n, 0.0), plus(n), minus(n), none(n, 0.0),
            tip(n);
    stiffness_matrix(model, q.data(), nullptr, load, K.data());
    double largest = 0.0;
    for (double value : K) largest = std::fmax(largest, std::fabs(value));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) CHECK_NEAR(K[i * n + j], K[j * n + i], 1e-12 * largest);
    Workspace<double> work(model);
    auto force_at = [&](Numbers &out) {
      forces(model, work, q.data(), zero.data(), zero.data(), Terms{}, out.data());
      std::fill(tip.begin(), tip.end(), 0.0);
      add_tip_load(model, work, load, tip.data());
      for (int i = 0; i < n; ++i) out[i] -= tip[i];
    };
    for (int j = 0; j < n; ++j) {
      const double at = q[j], step = 1e-5;
      q[j] = at + step, force_at(plus), q[j] = at - step, force_at(minus), q[j] = at;
      for (int i = 0; i < n; ++i)
        CHECK_NEAR((plus[i] - minus[i]) / (2.0 * step), K[i * n + j], 1e-6 * largest);
    }
    // the sweeps of statics, joints held
    ChainAtRest still(model, q.data(), nullptr);
    double size;
    still.energy(q.data(), load, 1.0, size);
    still.gradient(q.data(), load, 1.0, plus.data());
    force_at(minus);
    const std::vector<int> rows = moving_rows(model, nullptr);
    for (int i : rows) CHECK_NEAR(plus[i], minus[i], 1e-12 * size);
    Numbers M(n * n), r(n, 0.0), x(n);
    mass_matrix(model, q.data(), M.data());
    for (int i : rows) r[i] = random(-1.0, 1.0);
    still.tangent(load, 1.0, 50.0, false), still.solve(r.data(), x.data());
    for (int i : rows) {
      double sum = -r[i], parts = 0.0;
      for (int j : rows)
        sum += (K[i * n + j] + 50.0 * M[i * n + j]) * x[j],
            parts += std::fabs((K[i * n + j] + 50.0 * M[i * n + j]) * x[j]);
      CHECK_NEAR(sum, 0.0, 1e-11 * (1.0 + parts));
    }
  }
}

TEST("a clamped strip: frequencies of 2, 4 and 8 elements, and of its modes; pinned") {
  const double exact[3] = {3.5160152687, 22.0344915650, 61.6972144236}, pinned = 15.4182057170;
  const double within[3][3] = {
      {4.9e-4, 9.7e-3, 0.23}, {3.4e-5, 1.2e-3, 8.1e-3}, {2.2e-6, 8.1e-5, 6.2e-4}};
  for (int k = 0; k < 3; ++k) {
    const Model<double> model = cantilever(2 << k);
    const Numbers q(model.n, 0.0);
    const NaturalModes modes = natural_modes(model, q.data(), nullptr, 3);
    for (int i = 0; i < 3; ++i)
      CHECK_NEAR(2.0 * pi * modes.frequencies()[i] / exact[i], 1.0, within[k][i]);
    const char free[1] = {1};
    const NaturalModes turning = natural_modes(model, q.data(), free, 2);
    CHECK_NEAR(turning.squares[0], 0.0, 1e-9);
    CHECK_NEAR(std::sqrt(turning.squares[1]) / pinned, 1.0, k == 0 ? 7e-3 : k == 1 ? 7e-4 : 5e-5);
  }
  Robot robot;
  robot.links = {strip(1.0, 1.0, 1.0, 8)};
  robot.links[0].modes = 4;
  const Model<double> model = assemble(robot);
  const Numbers q(model.n, 0.0);
  const NaturalModes modes = natural_modes(model, q.data(), nullptr, 0);
  CHECK(modes.count == 4);
  for (int i = 0; i < 3; ++i) CHECK_NEAR(std::sqrt(modes.squares[i]) / exact[i], 1.0, 5e-6);
}

TEST(
    "a massless beam with a heavy head: 0.96596103 and 4.11089377 Hz, whatever little the beam "
    "weighs") {
  for (double mass : {0.0, 1e-9, 1e-6, 1e-3})
    for (int elements : {4, 8, 60}) {
      Robot robot;
      robot.links = {strip(4.0, mass, 1.024e7, elements)};
      robot.payload_mass = 1e4, robot.payload_inertia = 2e4, robot.links[0].joint.locked = true;
      const Model<double> model = assemble(robot);
      const Numbers q(model.n, 0.0);
      const Numbers f = natural_modes(model, q.data(), nullptr, 2).frequencies();
      CHECK(f.size() == 2);
      if (f.size() < 2) continue;
      CHECK_NEAR(f[0], 0.96596103, 1.1e-8 + 5e-5 * mass);
      CHECK_NEAR(f[1], 4.11089377, 1.1e-8 + 5e-4 * mass);
    }
}

TEST(
    "a square is negative where the column has buckled; the load lowers it to zero at pi^2 EI/(4 "
    "L^2)") {
  const Model<double> model = cantilever(8);
  Numbers q(model.n, 0.0);
  TipLoad load;
  auto lowest = [&](double share) {
    load.force[0] = -share * pi * pi / 4.0;
    return natural_modes(model, q.data(), nullptr, 1, load).squares[0];
  };
  CHECK(lowest(0.99999) > 0.0 && lowest(1.0001) < 0.0);
  CHECK_NEAR(lowest(1.0), 0.0, 1e-3);
  CHECK(natural_modes(model, q.data(), nullptr, 1, load).frequencies()[0] >= 0.0);
}

TEST("a level link on a bare pin that sags by a tenth of its length: frequencies, M > 0") {
  Robot robot;
  robot.gravity[1] = -9.81;
  robot.links = {strip(1.8, 0.4, 27.0, 16)};
  const Model<double> model = assemble(robot);
  Numbers q(model.n, 0.0), M(model.n * model.n);
  const Equilibrium sag = equilibrium(model, q.data());
  CHECK(sag.balance == Balance::stable && sag.tip.y < -0.09 * 1.8);
  mass_matrix(model, q.data(), M.data());
  CHECK(definiteness(model.n, M) > 0.0);
  const char free[1] = {1};
  for (const NaturalModes &modes :
       {natural_modes(model, q.data(), nullptr, 0), natural_modes(model, q.data(), free, 0)}) {
    for (double square : modes.squares) CHECK(square > -30.0 && std::isfinite(square));
    const int n = model.n, count = modes.count;
    double worst = 0.0;
    for (int a = 0; a < count; ++a)
      for (int b = 0; b < count; ++b) {
        double sum = a == b ? -1.0 : 0.0;
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j)
            sum += modes.shapes[i * count + a] * M[i * n + j] * modes.shapes[j * count + b];
        worst = std::fmax(worst, std::fabs(sum));
      }
    CHECK_NEAR(worst, 0.0, 1e-8);
  }
}

TEST("a stiff pendulum swings with sqrt(3 g / (2 L)); all joints of a mixed robot free") {
  Robot robot;
  robot.gravity[0] = 9.81;  // hanging along x
  robot.links = {strip(1.0, 1.0, 1e7, 4)};
  const Model<double> model = assemble(robot);
  const Numbers q(model.n, 0.0);
  const char free[5] = {1, 1, 1, 1, 1};
  CHECK_NEAR(std::sqrt(natural_modes(model, q.data(), free, 1).squares[0]), std::sqrt(1.5 * 9.81),
             1e-6);
  check::Random random;
  const Model<double> other = assemble(mixed());
  const Numbers z = bent(other, 0.3, random);
  const NaturalModes modes = natural_modes(other, z.data(), free, 0);
  CHECK(modes.count == other.n);
  for (double square : modes.squares) CHECK(std::isfinite(square));
}

TEST("the lowest 20 of many: as from the matrices; two equal arms; rigid motions; few masses") {
  Robot robot;
  robot.gravity[1] = -9.81;
  robot.links = {strip(1.0, 0.5, 20.0, 30), strip(0.8, 0.4, 10.0, 30), strip(0.8, 0.4, 10.0, 30)};
  robot.links[1].joint.hub_mass = 0.3, robot.payload_mass = 0.2;
  const char frees[3][3] = {{0, 0, 0}, {1, 1, 1}, {0, 1, 0}};
  for (double gravity : {-9.81, -1e-12, 0.0})
    for (const char *free : frees) {
      robot.gravity[1] = gravity;
      const Model<double> model = assemble(robot);
      Numbers q(model.n, 0.0);
      q[0] = -1.2, q[model.first[1]] = 0.6, q[model.first[2]] = -0.3;
      CHECK(equilibrium(model, q.data()).balance == Balance::stable);
      const NaturalModes some = lowest_modes(model, q.data(), free, 20, {}),
                         all = natural_modes(model, q.data(), free, 0);
      CHECK(some.count == 20);
      for (int k = 0; k < some.count; ++k)
        CHECK_NEAR(some.squares[k], all.squares[k],
                   1e-9 * std::fabs(all.squares[k]) + 1e-7 * std::fabs(all.squares[4]));
      double worst = 0.0;  // shapes: as far as they are apart
      for (int k = 6; k < 12; ++k)
        for (int i = 0; i < model.n; ++i)
          worst =
              std::fmax(worst, std::fabs(some.shapes[i * 20 + k] - all.shapes[i * all.count + k]));
      CHECK_NEAR(worst, 0.0, 1e-5);
      CHECK(lowest_modes(model, q.data(), free, 20, {}, false).squares == some.squares);
    }
  robot.gravity[1] =
      0.0;  // along x, and loads that are next to none but keep joints from being free
  for (int by = 0; by < 4; ++by) {
    robot.gravity[0] = by == 0 ? 1e-12 : 0.0;
    TipLoad load;
    if (by < 3)
      load.force[by % 2] = by == 0 ? 0.0 : 1e-12;
    else
      load.moment = 1e-12;
    const Model<double> model = assemble(robot);
    const Numbers q(model.n, 0.0);
    const NaturalModes some = lowest_modes(model, q.data(), frees[1], 10, load),
                       all = natural_modes(model, q.data(), frees[1], 0, load);
    CHECK(some.count == 10);
    for (int k = 0; k < some.count; ++k)
      CHECK_NEAR(some.squares[k], all.squares[k],
                 1e-9 * std::fabs(all.squares[k]) + 1e-7 * std::fabs(all.squares[4]));
  }
  robot.gravity[0] = 0.0;
  {  // more than there are
    const Model<double> model = cantilever(45);
    const Numbers q(model.n, 0.0);
    const NaturalModes some = lowest_modes(model, q.data(), nullptr, 1000, {}),
                       all = natural_modes(model, q.data(), nullptr, 0);
    CHECK(some.count <= all.count && some.count > 30);
    for (int k = 0; k < 30; ++k) CHECK_NEAR(some.squares[k] / all.squares[k], 1.0, 1e-8);
  }
  robot.links.assign(8, strip(0.5, 0.4, 10.0, 15));
  for (double gravity :
       {-1e-12, 0.0}) {  // eight squares are 0, or so near to it that a search meets one of them
    robot.gravity[1] = gravity;
    const Model<double> model = assemble(robot);
    const Numbers q(model.n, 0.0);
    const char all_free[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    const NaturalModes all = natural_modes(model, q.data(), all_free, 0);
    for (int most : {1, 3, 8, 9, 10, 12}) {
      const NaturalModes some = lowest_modes(model, q.data(), all_free, most);
      CHECK(some.count == most);
      for (int k = 0; k < some.count; ++k)
        CHECK_NEAR(some.squares[k], k < 8 ? 0.0 : all.squares[k], 1e-9 * all.squares[8]);
    }
  }
  Robot light;
  light.links = {strip(4.0, 0.0, 1.024e7, 60)};
  light.payload_mass = 1e4, light.payload_inertia = 2e4, light.links[0].joint.locked = true;
  const Model<double> model = assemble(light);
  const Numbers q(model.n, 0.0);
  const NaturalModes two = lowest_modes(model, q.data(), nullptr, 5, {});
  CHECK(two.count == 2);
  CHECK_NEAR(two.frequencies()[0], 0.96596103, 1e-8);
}

TEST(
    "a free slider, or many of the modes: from the matrices, to the same squares as in the "
    "search") {
  Robot robot;
  robot.links = {strip(1.0, 0.5, 20.0, 30), strip(0.8, 0.4, 10.0, 40)};
  robot.links[1].joint.hub_mass = 0.3, robot.payload_mass = 0.2;
  const char turns[2] = {0, 1}, none[2] = {0, 0};
  for (bool slides : {false, true}) {
    if (slides) robot.links[1].joint.kind = JointKind::slider, robot.links[1].joint.start = 0.9;
    const Model<double> model = assemble(robot);
    Numbers q(model.n, 0.0);
    if (slides) q[model.first[1]] = 0.9;
    const NaturalModes few = natural_modes(model, q.data(), turns, 5),
                       many = natural_modes(model, q.data(), turns, model.n / 2);
    CHECK(few.count == 5 && many.count == model.n / 2);
    for (int k = 1; k < 5; ++k) CHECK_NEAR(few.squares[k], many.squares[k], 1e-7 * many.squares[4]);
    TipLoad load;  // a load on its own is not idle
    load.force[slides] = 1e-9, load.moment = slides ? 0.0 : 1e-9;
    CHECK_NEAR(natural_modes(model, q.data(), none, 3, load).squares[2],
               natural_modes(model, q.data(), none, 3).squares[2], 1e-3 * many.squares[4]);
  }
}

TEST(
    "the linearised motion: M da/df = 1, M da/dq = -K at rest, -D by the rates, held joints stay") {
  const Model<double> model = assemble(mixed());
  const int n = model.n;
  check::Random random;
  const char free[5] = {1, 1, 1, 1, 1};
  Numbers q = bent(model, 0.4, random), zero(n, 0.0), hold(n), M(n * n), K(n * n), D(n * n);
  Workspace<double> work(model);
  forces(model, work, q.data(), zero.data(), zero.data(), Terms{},
         hold.data());  // what holds it at rest
  const Linear linear = linearise(model, q.data(), zero.data(), hold.data(), nullptr);
  mass_matrix(model, q.data(), M.data());
  stiffness_matrix(model, q.data(), nullptr, {}, K.data());
  rate_matrix(model, q.data(), zero.data(), D.data());
  double largest = 0.0;
  for (double value : K) largest = std::fmax(largest, std::fabs(value));
  for (int i = 0; i < n; ++i) {
    CHECK_NEAR(linear.acceleration[i], 0.0, 1e-7);
    for (int j = 0; j < n; ++j) {
      double unit = i == j ? -1.0 : 0.0, stiff = K[i * n + j], damped = D[i * n + j];
      for (int k = 0; k < n; ++k) {
        unit += M[i * n + k] * linear.by_force[k * n + j];
        stiff += M[i * n + k] * linear.by_position[k * n + j],
            damped += M[i * n + k] * linear.by_rate[k * n + j];
      }
      CHECK_NEAR(unit, 0.0, 1e-8);
      CHECK_NEAR(stiff, 0.0, 1e-9 * largest);
      CHECK_NEAR(damped, 0.0, 1e-9 * largest);
    }
  }
  const Linear held = linearise(model, q.data(), zero.data(), hold.data(), free);
  for (int j = 0; j < n; ++j) CHECK(held.by_force[j] == 0.0 && held.by_position[j] == 0.0);
}

TEST("a sleeved link cut into alike parts has the numbers of one, at any free length") {
  check::Random random;
  Robot whole;
  whole.gravity[0] = 1.0, whole.gravity[1] = -6.0, whole.payload_mass = 0.1;
  Link base = strip(0.5, 0.4, 2.0, 2), sleeved = strip(0.6, 0.3, 1.5, 3);
  sleeved.joint.kind = JointKind::sleeve, sleeved.joint.start = 0.4, sleeved.alpha = 0.3;
  sleeved.material[0].mass[1] = -0.1, sleeved.material[0].stiffness[1] = -0.5;  // tapered
  whole.links = {base, sleeved};
  Robot cut = whole;
  Interval &first = cut.links[1].material[0], second = first, third = first;
  first.to = second.from = 0.22, second.to = third.from = 0.37;
  for (Interval *part : {&second, &third}) {
    part->mass[0] += part->from * part->mass[1];
    part->stiffness[0] += part->from * part->stiffness[1];
  }
  cut.links[1].material = {first, second, third};
  const Model<double> one = assemble(whole), three = assemble(cut);
  CHECK(one.n == three.n);
  for (int k = 0; k < 10; ++k) {
    Numbers q = bent(one, 0.5, random), v = bent(one, 1.0, random), a = bent(one, 1.0, random);
    q[one.first[1]] = random(0.1, 0.55);
    Numbers f(one.n), g(one.n), M(one.n * one.n), N(M);
    Workspace<double> work(one), other(three);
    forces(one, work, q.data(), v.data(), a.data(), Terms{}, f.data());
    forces(three, other, q.data(), v.data(), a.data(), Terms{}, g.data());
    for (int i = 0; i < one.n; ++i) CHECK_NEAR(f[i], g[i], 1e-12);
    mass_matrix(one, q.data(), M.data()), mass_matrix(three, q.data(), N.data());
    for (int i = 0; i < one.n * one.n; ++i) CHECK_NEAR(M[i], N[i], 1e-13);
    CHECK_NEAR(energies(one, work, q.data(), v.data()).potential,
               energies(three, other, q.data(), v.data()).potential, 1e-13);
  }
}

TEST("numbers that are none end every search") {
  const Model<double> model = cantilever(60);
  Numbers q(model.n, std::nan(""));
  CHECK(natural_modes(model, q.data(), nullptr, 5).squares.size() <= 5);
  CHECK(natural_modes(model, q.data(), nullptr, 0).squares.size() <= std::size_t(model.n));
  CHECK(equilibrium(model, q.data()).balance != Balance::stable);
}

TEST("damping in proportion to mass (26) is alpha times M of the straight, clamped link") {
  check::Random random;
  const double alpha = 1.7;
  for (const Robot &robot : damped(alpha)) {
    const Model<double> model = assemble(robot);
    Numbers q(model.n), v(model.n), M(model.n * model.n), rows(model.n);
    const int joint = model.first[0];
    if (model.kind[0] == JointKind::sleeve) q[joint] = 0.35;
    for (int k = 0; k < model.n; ++k) v[k] = k == joint ? 0.0 : random(-1.0, 1.0);
    mass_matrix(model, q.data(), M.data());
    add_mass_damping(model, q.data(), v.data(), rows.data());
    double largest = 0.0;
    for (int k = 0; k < model.n; ++k) {
      if (k == joint) continue;
      double expected = 0.0;
      for (int l = 0; l < model.n; ++l) expected += alpha * M[k * model.n + l] * v[l];
      CHECK_NEAR(rows[k], expected, 1e-14);
      largest = std::fmax(largest, std::fabs(expected));
    }
    CHECK(largest > 1e-3);
  }
}
