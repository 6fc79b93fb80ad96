// What acts on the robots of a pack at one instant, as numbers for a pass. Each lane has its own
// `Inputs` and its own time.
#pragma once
#include <array>
#include <memory>
#include <vector>

#include "control/inputs.hpp"
#include "control/plant.hpp"
#include "dynamics/friction.hpp"
#include "numbers/pack_lane.hpp"

namespace flexura {

template <class Real>
class DriveForces {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  std::vector<Real> reaction;  // (joints) of the pass just made

  DriveForces(Plant<Real> &robot, Inputs *const *acting)
      : reaction(robot.joints, Real(0.0)),
        plant(robot),
        held(new char[robot.joints]),
        force(robot.n, Real(0.0)) {
    for (auto *x : {&stiffness, &damping, &given, &steady, &set_point, &set_point_rate, &place,
                    &rate, &applied, &last_speed, &function_stiffness, &function_damping})
      x->assign(robot.joints, Real(0.0));
    for (int k = 0; k < LANES; ++k) of[k] = acting[k];
    for (int i = 0; i < plant.joints; ++i) {
      held[i] = plant.locked[i] || follows(i);
      for (int k = 0; k < LANES && !held[i]; ++k) {
        const JointDrive &d = of[k]->joints[i];
        if (!d.follows()) continue;
        set_lane(stiffness[i], k, d.kp), set_lane(damping[i], k, d.kd);
      }
      gains.push_back(stiffness[i]), gains.push_back(damping[i]);
    }
    for (int k = 0; k < LANES; ++k) calls |= static_cast<bool>(of[k]->function);
    scratch.assign(2 * plant.n + plant.joints, 0.0);
    if (LANES > 1) return;
    for (const PointLoad &load : of[0]->loads) places.push_back(load.place);
    values.assign(3 * places.size(), Real(0.0)), loads.assign(plant.n, Real(0.0));
  }

  Inputs &acting(int k) const { return *of[k]; }
  bool any_prescribed() const {
    for (int i = 0; i < plant.joints; ++i)
      if (follows(i)) return true;
    return false;
  }

  // Signals and what is held, at time t.
  void at(const Real &t) {
    time = t;
    for (int i = 0; i < plant.joints; ++i)
      for (int k = 0; k < LANES; ++k) {
        const Inputs &a = *of[k];
        set_lane(steady[i], k, a.force(i, lane(t, k)));
        if (!a.joints[i].follows()) continue;
        const Motion m = a.motion(i, lane(t, k));
        if (a.joints[i].prescribed)
          set_lane(place[i], k, m.y), set_lane(rate[i], k, m.yd), set_lane(given[i], k, m.ydd);
        else
          set_lane(set_point[i], k, m.y), set_lane(set_point_rate[i], k, m.yd);
      }
    for (std::size_t a = 0; a < values.size(); ++a)
      values[a] = evaluate(of[0]->loads[a / 3].value[a % 3], lane(t, 0)).y;
  }

  // Puts prescribed joints where their motion has them.
  void prescribe(Real *q, Real *v) const {
    for (int i = 0; i < plant.joints; ++i)
      if (follows(i)) q[plant.first[i]] = place[i], v[plant.first[i]] = rate[i];
  }

  // The forces of a plain pass at (q, v).
  void load(const Real *q, const Real *v) {
    call(q, v);
    put_loads(q);
    for (int i = 0; i < plant.joints; ++i) {
      if (held[i]) continue;
      force[plant.first[i]] = constant(i) + on_unknown(plant.first[i]);
      if (has_coulomb(i)) force[plant.first[i]] -= coulomb(i, v[plant.first[i]]);
      stiffness[i] = gains[2 * i], damping[i] = gains[2 * i + 1];
    }
  }

  // The forces of a pass of an implicit stage whose last iterate is (q, v), the stages of robots
  // `which` being open: Coulomb friction is taken as linear in the speed to come, by the tangent
  // where the speed has settled to a fraction of v0 between iterates, else by the line through
  // zero, which never overshoots.
  void load_stage(const Real &which, const Real *q, const Real *v, bool first) {
    call(q, v, which);
    put_loads(q);
    for (int i = 0; i < plant.joints; ++i) {
      if (held[i]) continue;
      Real &f = force[plant.first[i]];
      f = constant(i) + on_unknown(plant.first[i]) + function_stiffness[i] * q[plant.first[i]] +
          function_damping[i] * v[plant.first[i]];
      stiffness[i] = gains[2 * i] + function_stiffness[i],
      damping[i] = gains[2 * i + 1] + function_damping[i];
      if (!has_coulomb(i)) continue;
      const Real speed = v[plant.first[i]],
                 change = first ? Real(1.0) : abs(speed - last_speed[i]) * (1.0 / plant.slow);
      const LinearFriction<Real> friction_ =
          linear_coulomb_friction(plant.coulomb[i], speed, change, plant.slow);
      damping[i] += friction_.slope, f += friction_.slope * speed - friction_.value;
      last_speed[i] = speed;
    }
  }

  // Looks how the caller's functions change with each joint's own position and speed at (q, v), so
  // that stages converge under a steep one; for the lanes `which`. (A slope that is wrong costs
  // passes, never the answer.)
  void estimate_function_slopes(const Real &which, const Real &t, const Real *q, const Real *v) {
    if (!calls) return;
    at(t);
    call(q, v);
    const std::vector<Real> here = applied;
    std::vector<Real> moved(q, q + plant.n), faster(v, v + plant.n);
    for (int i = 0; i < plant.joints; ++i) {
      if (held[i]) continue;
      const int e = plant.first[i];
      const Real small = 1e-6 * larger(abs(q[e]), Real(1e-2)),
                 little = 1e-6 * larger(abs(v[e]), Real(1e-2));
      moved[e] = q[e] + small, call(moved.data(), v), moved[e] = q[e];
      const Real s = larger(Real(0.0), (here[i] - applied[i]) / small);
      faster[e] = v[e] + little, call(q, faster.data()), faster[e] = v[e];
      const Real d = larger(Real(0.0), (here[i] - applied[i]) / little);
      take(which, &s, &function_stiffness[i], 1), take(which, &d, &function_damping[i], 1);
    }
  }

  PassInputs<Real> pass(const Real *q, const Real *v, const Real *ys, const Real *vs,
                        const Real &gq, const Real &gv) const {
    return {q,          v,           ys, vs, gq, gv, force.data(), stiffness.data(), damping.data(),
            held.get(), given.data()};
  }

  // The force of joint i's drive at (q, v), after `load` and, if it is prescribed, after the pass.
  Real drive(int i, const Real *q, const Real *v) const {
    const int e = plant.first[i];
    if (follows(i)) return reaction[i] + coulomb(i, v[e]) - on_unknown(e);
    return constant(i) - gains[2 * i] * q[e] - gains[2 * i + 1] * v[e];
  }

  bool has_loads() const { return !places.empty(); }
  // The generalised force of all loads on links, at the last pass, in row e (133).
  Real on_unknown(int e) const { return loads.empty() ? Real(0.0) : loads[e]; }
  // The same at q, of loads of other sizes: `value` (loads, 3), into `out` (n).
  void loads_at(const Real *q, const Real *value, Real *out) const {
    plant.add_loads(places.data(), int(places.size()), value, q, out);
  }

  // Power of all drives and loads [W].
  Real work(const Real *q, const Real *v) const {
    Real sum = 0.0;
    for (std::size_t e = 0; e < loads.size(); ++e) sum += loads[e] * v[e];
    for (int i = 0; i < plant.joints; ++i)
      if (!plant.locked[i]) sum += drive(i, q, v) * v[plant.first[i]];
    return sum;
  }

  // Power lost to friction in the joints [W].
  Real friction(const Real *v) const {
    Real sum = 0.0;
    for (int i = 0; i < plant.joints; ++i) {
      const Real &speed = v[plant.first[i]];
      sum += (plant.viscous[i] * speed + coulomb(i, speed)) * speed;
    }
    return sum;
  }

 private:
  Plant<Real> &plant;
  std::array<Inputs *, LANES> of;
  std::unique_ptr<char[]> held;
  std::vector<Real> force, stiffness, damping, given, steady, set_point, set_point_rate, place,
      rate, applied, last_speed;
  std::vector<Real> function_stiffness,
      function_damping;     // how the caller's functions fall with a joint's own position and speed
  std::vector<Real> gains;  // kp, kd of each joint
  std::vector<double> scratch;
  std::vector<LoadPlace> places;  // of loads on links
  std::vector<Real> values,       // (loads, 3) now
      loads;                      // (n) their generalised forces at the last pass; or empty
  Real time = 0.0;
  bool calls = false;

  // (All lanes of a pack prescribe the same joints.)
  bool follows(int i) const {
    return of[0]->joints[i].prescribed && of[0]->joints[i].follows() && !plant.locked[i];
  }
  bool has_coulomb(int i) const { return worst(plant.coulomb[i]) > 0.0; }
  Real constant(int i) const {
    return steady[i] + applied[i] + gains[2 * i] * set_point[i] +
           gains[2 * i + 1] * set_point_rate[i];
  }
  Real coulomb(int i, const Real &speed) const {  // Coulomb friction
    return worst(plant.coulomb[i]) > 0.0 ? coulomb_friction(plant.coulomb[i], speed, plant.slow)
                                         : Real(0.0);
  }

  // The generalised forces of the loads at q: those of the elastic unknowns into `force`.
  void put_loads(const Real *q) {
    if (places.empty()) return;
    std::fill(loads.begin(), loads.end(), Real(0.0));
    loads_at(q, values.data(), loads.data());
    force = loads;
  }

  // The caller's functions at (q, v), of the robots `which`; the others keep their forces.
  void call(const Real *q, const Real *v, const Real &which = Real(1.0)) {
    if (!calls) return;
    double *place_ = scratch.data(), *rate_ = place_ + plant.n, *out = rate_ + plant.n;
    for (int k = 0; k < LANES; ++k) {
      if (!of[k]->function || lane(which, k) == 0.0) continue;
      for (int j = 0; j < plant.n; ++j) place_[j] = lane(q[j], k), rate_[j] = lane(v[j], k);
      for (int i = 0; i < plant.joints; ++i) out[i] = 0.0;
      of[k]->function(lane(time, k), place_, rate_, out);
      for (int i = 0; i < plant.joints; ++i) set_lane(applied[i], k, out[i]);
    }
  }
};

}  // namespace flexura
