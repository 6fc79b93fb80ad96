// A Model as the time loop sees it.
#pragma once
#include <type_traits>

#include "control/plant.hpp"
#include "dynamics/mass_matrix.hpp"
#include "dynamics/places/energies.hpp"
#include "dynamics/places/point_loads.hpp"
#include "numbers/pack_lane.hpp"

namespace flexura {

template <class Real>
class ModelPlant : public Plant<Real> {
 public:
  static constexpr int TURNS = 12;        // of the power iteration for the highest frequency
  static constexpr double MARGIN = 1.08;  // by which it may fall short
  static constexpr double LEAST =
      0.01;  // of the robot's length: the lever of a joint that turns nothing long
  static constexpr double INSIDE =
      0.1;  // what a shape that leaves the tip where it is still weighs

  ModelPlant(const Model<Real> &robot, Workspace<Real> &memory);

  void accelerate(const PassInputs<Real> &p, Real *a, Real *reactions) override {
    flexura::accelerate(model, work, p.q, p.v,
                        Stage<Real>{p.ys, p.vs, p.gq, p.gv, p.stiffness, p.damping}, p.force,
                        Held<Real>{p.held, p.given, reactions}, a);
  }

  void powers(const Real *q, const Real *v, Real &strain, Real &loss) override {
    strain = loss = Real(0.0);
    for (const Piece<Real> &c : model.pieces) {
      if (c.joint != HubJoint::none) {
        const std::size_t link = std::size_t(c.link);
        strain += model.spring[link] * (q[c.first] - model.rest[link]) * v[c.first];
      }
      if (c.joint == HubJoint::sleeve) {
        sleeve_powers(c, q, v, strain, loss);
        continue;
      }
      const Real *own = q + c.own(), *rate = v + c.own();
      for (int l = 0; l < c.m; ++l)
        strain += c.K[l] * own[l] * rate[l], loss += c.D[l] * rate[l] * rate[l];
    }
    if (!model.mass_damped) return;
    for (int k = 0; k < this->n; ++k) rest[std::size_t(k)] = Real(0.0);
    add_mass_damping(model, q, v, rest.data());
    for (int k = 0; k < this->n; ++k) loss += rest[std::size_t(k)] * v[k];
  }

  Real strain(const Real *q) override {
    Real twice = 0.0, sleeves = 0.0;
    for (const Piece<Real> &c : model.pieces) {
      if (c.joint != HubJoint::none) sleeves += spring_energy(model, c, q);
      if (c.joint == HubJoint::sleeve)
        sleeves += sleeve_strain(c, q);
      else
        for (int l = 0; l < c.m; ++l) twice += c.K[l] * q[c.own() + l] * q[c.own() + l];
    }
    return 0.5 * twice + sleeves;
  }

  Real energy(const Real *q, const Real *v) override {
    const Energies<Real> e = energies(model, work, q, v);
    return e.kinetic + e.strain;
  }

  // Power iteration x <- M^-1 K x with passes, K with the gains of the joints; its growth is
  // measured in the energy x K x. Decay by the material's damping is that of the fastest mode, by
  // joints that of the joint alone.
  Real fastest(const Real *q, const PassInputs<Real> &pass) override {
    pull(q, zero.data(), pass, rest.data());
    for (int k = 0; k < this->n; ++k)
      x[std::size_t(k)] = Real(k % 2 ? -1.0 - 0.01 * k : 1.0 + 0.013 * k);
    Real square = 0.0, damped = 0.0;
    for (int turn = 0; turn < TURNS; ++turn) {
      Real before, after, lost;
      stretch(q, pass, x.data(), before, lost);
      const Real scale = 1.0 / root(larger(before, Real(1e-300)));
      for (Real &value : x) value *= scale;
      stretch(q, pass, x.data(), before, lost);
      for (int k = 0; k < this->n; ++k) force[std::size_t(k)] = -force[std::size_t(k)];
      pull(q, force.data(), pass, x.data());
      for (int k = 0; k < this->n; ++k) x[std::size_t(k)] -= rest[std::size_t(k)];
      stretch(q, pass, x.data(), after, lost);
      square = root(after / larger(before, Real(1e-300)));
      damped = square * (lost / larger(after, Real(1e-300)));
    }
    Real most = larger(root(square), damped);
    for (int i = 0; i < this->joints; ++i) {
      const Real resistance = pass.damping[i] + this->viscous[i];
      if (pass.held[i] || !(worst(resistance) > 0.0)) continue;
      for (Real &value : force) value = Real(0.0);
      force[std::size_t(this->first[i])] = Real(1.0);
      pull(q, force.data(), pass, x.data());
      most = larger(
          most, resistance * (x[std::size_t(this->first[i])] - rest[std::size_t(this->first[i])]));
    }
    return MARGIN * most;
  }

  bool matrices(int lane_, const Real *q, double *M, double *K, double *D) override {
    const int n = this->n;
    const std::size_t size = std::size_t(n);
    all.assign(size * size, Real(0.0)), wrench.resize(size);
    mass_matrix(model, work, q, zero.data(), wrench.data(), all.data());
    for (std::size_t i = 0; i < size * size; ++i) M[i] = lane(all[i], lane_), K[i] = D[i] = 0.0;
    if (model.mass_damped) {
      std::vector<Real> unit(zero), lost(zero);
      for (int i = 0; i < n; ++i) {
        unit[std::size_t(i)] = Real(1.0), std::fill(lost.begin(), lost.end(), Real(0.0));
        add_mass_damping(model, q, unit.data(), lost.data());
        unit[std::size_t(i)] = Real(0.0);
        for (int j = 0; j < n; ++j) D[j * n + i] = lane(lost[std::size_t(j)], lane_);
      }
    }
    for (int i = 0; i < this->joints; ++i) {
      const std::size_t row = std::size_t(this->first[std::size_t(i)]);
      K[row * size + row] = lane(model.spring[std::size_t(i)], lane_);
    }
    for (const Piece<Real> &c : model.pieces)
      for (int l = 0; l < c.m; ++l) {
        const int row = c.own() + l;
        if (c.joint != HubJoint::sleeve) {
          K[row * n + row] = lane(c.K[l], lane_), D[row * n + row] += lane(c.D[l], lane_);
          continue;
        }
        for (int p = 0; p < c.P; ++p) {
          const MaterialPoint<Real> here = free_length_material(c, q[c.first], p);
          const Real moment =
              here.stiffness * c.weight[p] * c.bend[l * padded(c.P) + p] / q[c.first];
          for (int k = 0; k < c.m; ++k) {
            const double entry = lane(Real(moment * c.bend[k * padded(c.P) + p]), lane_);
            K[row * n + c.own() + k] += entry,
                D[row * n + c.own() + k] += lane(c.beta, lane_) * entry;
          }
        }
      }
    return true;
  }

  bool observe(int lane_, const Real *q, double *out) override {
    std::vector<Pose<Real>> poses(std::size_t(this->joints) + 1);
    Real speed[2];
    outward_kinematics(model, work, q, zero.data());
    hub_poses(model, work, q, zero.data(), poses.data(), speed);
    for (int i = 0; i < this->joints; ++i) {
      out[i] = 0.0;
      for (int k = this->first[std::size_t(i)]; k < this->first[std::size_t(i) + 1]; ++k)
        out[i] += lane(this->deflect[std::size_t(k)] * q[k], lane_);
    }
    out[this->joints] = lane(poses.back().x, lane_),
    out[this->joints + 1] = lane(poses.back().y, lane_);
    return true;
  }

  void add_loads(const LoadPlace *places, int count, const Real *values, const Real *q,
                 Real *out) override {
    if constexpr (std::is_same_v<Real, double>)
      add_point_loads(model, work, places, count, values, q, out);
    else
      Plant<Real>::add_loads(places, count, values, q, out);
  }

  // A slider that has run into the sleeve of the link it rides on.
  int blocked(int lane_, const Real *q) const override {
    for (std::size_t i = 1; i < model.pieces.size(); ++i) {
      const Piece<Real> &on = model.pieces[i - 1], &c = model.pieces[i];
      if (c.joint != HubJoint::slider || on.joint != HubJoint::sleeve ||
          this->locked[std::size_t(c.link)])
        continue;
      if (lane(Real(q[c.first] + c.offset - on.length + q[on.first]), lane_) < 0.0) return c.link;
    }
    return -1;
  }

 private:
  const Model<Real> &model;
  Workspace<Real> &work;
  std::vector<Real> x, rest, force, zero, reaction;
  std::vector<Real> all;  // scratch of `matrices`: (n, n)
  std::vector<Vec3<Real>> wrench;

  // Accelerations under n forces at rest, without K q.
  void pull(const Real *q, const Real *forces_, const PassInputs<Real> &pass, Real *a) {
    const Stage<Real> still{zero.data(), zero.data(), Real(0.0), Real(0.0), nullptr, nullptr};
    std::vector<Real> given(reaction.size(), Real(0.0));
    flexura::accelerate(model, work, q, zero.data(), still, forces_,
                        Held<Real>{pass.held, given.data(), reaction.data()}, a);
  }

  // K z into `force`, z K z and z D z.
  void stretch(const Real *q, const PassInputs<Real> &pass, const Real *z, Real &energy_,
               Real &lost) {
    energy_ = lost = Real(0.0);
    for (const Piece<Real> &c : model.pieces) {
      if (c.joint != HubJoint::none) {
        const Real stiffness = pass.held[c.link]
                                   ? Real(0.0)
                                   : pass.stiffness[c.link] + model.spring[std::size_t(c.link)];
        force[std::size_t(c.first)] = stiffness * z[c.first],
        energy_ += stiffness * z[c.first] * z[c.first];
      }
      if (c.joint == HubJoint::sleeve) {
        Real bent[Free::most];
        bending(c, z + c.own(), bent);
        for (int l = 0; l < c.m; ++l) force[std::size_t(c.own() + l)] = Real(0.0);
        for (int p = 0; p < c.P; ++p) {
          const Real moment =
              free_length_material(c, q[c.first], p).stiffness * c.weight[p] * bent[p] / q[c.first];
          energy_ += moment * bent[p], lost += c.beta * moment * bent[p];
          for (int l = 0; l < c.m; ++l)
            force[std::size_t(c.own() + l)] += moment * c.bend[l * padded(c.P) + p];
        }
        continue;
      }
      for (int l = 0; l < c.m; ++l) {
        const Real &own = z[c.own() + l];
        force[std::size_t(c.own() + l)] = c.K[l] * own, energy_ += c.K[l] * own * own,
                                    lost += c.D[l] * own * own;
      }
    }
  }

  static void sleeve_powers(const Piece<Real> &c, const Real *q, const Real *v, Real &strain,
                            Real &loss) {
    Real bent[Free::most], moving[Free::most];
    bending(c, q + c.own(), bent), bending(c, v + c.own(), moving);
    const Real inverse = 1.0 / q[c.first], flow = v[c.first];
    for (int p = 0; p < c.P; ++p) {
      const MaterialPoint<Real> here = free_length_material(c, q[c.first], p);
      const Real weight = here.stiffness * c.weight[p] * inverse;
      const Real weight_slope =  // by d
          c.weight[p] * inverse *
          (here.stiffness_slope * (c.xi[p] - 1.0) - here.stiffness * inverse);
      strain += weight * bent[p] * moving[p] + 0.5 * weight_slope * bent[p] * bent[p] * flow;
      loss += c.beta * weight * moving[p] * moving[p];
    }
  }

  // How far tips move with each unknown, of the straight robot: its own link's tip, and what is
  // beyond by the slope there.
  void weigh() {
    this->lever.assign(std::size_t(this->n), Real(1.0)),
        this->deflect.assign(std::size_t(this->n), Real(0.0));
    Real beyond = 0.0;  // length of the links beyond
    for (int link = this->joints; link-- > 0;) {
      Real own = 0.0;  // length of the link's pieces beyond
      for (int i = model.begin[std::size_t(link) + 1]; i-- > model.begin[std::size_t(link)];) {
        const Piece<Real> &c = model.pieces[std::size_t(i)];
        const Real scale = c.joint == HubJoint::sleeve ? c.length : Real(1.0);
        for (int l = 0; l < c.m; ++l) {
          Real tip = 0.0, inside = 0.0;
          for (int j = 0; j < c.P; ++j) {
            const Real part = scale * c.w[j] * c.B[l * padded(c.P) + j];
            tip += part, inside += abs(part);
          }
          const std::size_t k = std::size_t(c.own() + l);
          this->deflect[k] = tip + c.tip_angle[l] * own;
          this->lever[k] = larger(abs(tip), INSIDE * inside) + abs(c.tip_angle[l]) * (own + beyond);
        }
        for (int j = 0; j < c.P; ++j) own += scale * c.w[j];
      }
      beyond += own;
      if (model.kind[std::size_t(link)] == JointKind::revolute)
        this->lever[std::size_t(this->first[std::size_t(link)])] = beyond;
    }
    this->reach = choose_less(beyond, Real(1e-9), Real(1.0), beyond);
    for (int i = 0; i < this->joints; ++i) {
      Real &own = this->lever[std::size_t(this->first[std::size_t(i)])];
      if (model.kind[std::size_t(i)] == JointKind::revolute) own = larger(own, LEAST * this->reach);
      if (model.elastic_joint(i)) {
        Real &windup = this->lever[std::size_t(this->first[std::size_t(i)]) + 1];
        windup = larger(windup, LEAST * this->reach);
      }
    }
    this->travel.assign(std::size_t(this->joints),
                        Real(0.0));  // sleeves and sliders on links that bend
    for (std::size_t i = 0; i < model.pieces.size(); ++i) {
      const Piece<Real> &c = model.pieces[i];
      if (c.joint == HubJoint::sleeve) this->travel[std::size_t(c.link)] = 0.003 * c.length;
      if (c.joint != HubJoint::slider || i == 0 || model.pieces[i - 1].m == 0) continue;
      const Piece<Real> &rail = model.pieces[i - 1];
      const bool both = rail.joint == HubJoint::sleeve && !model.locked[std::size_t(rail.link)] &&
                        !model.locked[std::size_t(c.link)];
      this->rides |= both;
      this->travel[std::size_t(c.link)] = 0.003 * model.pieces[i - 1].length;
    }
  }
};

template <class Real>
ModelPlant<Real>::ModelPlant(const Model<Real> &robot, Workspace<Real> &memory)
    : model(robot),
      work(memory),
      x(std::size_t(robot.n)),
      rest(x),
      force(x),
      zero(std::size_t(robot.n), Real(0.0)) {
  this->n = model.n, this->joints = model.links();
  this->first = model.first, this->first.push_back(model.n);
  this->viscous = model.viscous, this->coulomb = model.coulomb, this->slow = COULOMB_SPEED;
  for (int i = 0; i < this->joints; ++i) this->locked.push_back(model.locked[std::size_t(i)] != 0);
  reaction.assign(std::size_t(this->joints), Real(0.0));
  weigh();
}

extern template class ModelPlant<double>;
extern template class ModelPlant<Pack<4>>;

}  // namespace flexura
