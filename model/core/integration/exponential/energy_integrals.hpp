// Work, loss and what the added damping takes, within a step of the modes: integrals of the motion
// that `DenseOutput` describes, in closed form however often a mode turns within the step (101).
//
// With P_j, Z_j the parts of joint j's rate that are a polynomial in x = t/h and free motion
// (dense_output.hpp), u_j its drive's force without the part of the gains, and H_mq = 1 / (m + q +
// 1),
//
//     int x^m v_j dt = sum_q H_mq P_jq x^(m+q+1) + sum_k phi_kj L_km,        L_km = int x^m z_k'
//     dt, int v_j^2 dt   = (P_j H P_j) / h + 2/h sum_q P_jq sum_k phi_kj L_kq + sum_k phi_kj^2 int
//     z_k'^2 dt, work           = sum_j int u_j v_j dt - kp_j [eta_j^2] / 2 - kd_j int v_j^2 dt,
//     u_j a polynomial through its last values, loss           = sum_j c_j int v_j^2 dt + sum_k
//     material_k int eta_k'^2 dt + int rest dt, numerical      = sum_k added_k int eta_k'^2 dt -
//     lag_k int N_k' eta_k' dt.
//
// Where the drives' forces are constant and nothing is lost, the work is u_j [eta_j] and needs no
// integral: most steps of an undamped robot under torques.
//
// `rest` is the power lost less the first two terms at the same instant (Coulomb friction, material
// whose damping couples modes). What is left out are products of two different free motions, which
// average out.
#pragma once
#include <algorithm>

#include "integration/exponential/dense_output.hpp"

namespace flexura {

template <class Real>
class EnergyIntegrals {
 public:
  static constexpr int LANES = LanesOf<Real>::value;

  // One joint that is free to move: its row; gains of its drive; viscous friction.
  struct Joint {
    int row;
    Real kp, kd, viscous;
  };
  // The extra numbers of a row of the history: u_j, then the rest of the loss, then the power of
  // prescribed joints.
  static int extras(int joints) { return joints + 2; }

  struct Sums {
    Real work, loss, numerical;   // over the first part of the step [J]
    Real work_error, loss_error;  // their uncertain part
  };

  EnergyIntegrals(const ExponentialAdams<Real> &steps, const DenseOutput<Real> &motion,
                  std::vector<Joint> free)
      : s(steps),
        w(motion),
        joints(std::move(free)),
        count(static_cast<int>(joints.size())),
        chunks(chunks_of<Real>(count + 2)),
        room(room_of<Real>(count + 2)) {
    memory.lay([this](auto take) {
      for (Real *&row : L) take(row, s.stride);
      for (Real **vector : {&Qz, &square, &added}) take(*vector, s.stride);
      for (Real **vector : {&total, &error, &squares}) take(*vector, room);
      take(U, POWERS * room), take(uncertain, POWERS * room), take(P, ORDER * room),
          take(Z, POWERS * room);
      take(phi, s.n * room), take(phi2, s.n * room);
    });
    for (const Joint &joint : joints)
      for (int k = 0; k < LANES; ++k)
        damped_of[k] = damped_of[k] || lane(abs(joint.kd) + abs(joint.viscous), k) > 0.0;
    for (bool of_robot : damped_of) damped = damped || of_robot;
  }

  const std::vector<Joint> &free_joints() const { return joints; }

  // The numbers of a row at a state with the rates v (n) and eta' (stride): forces (joints) of the
  // drives there with their gains' part, the joints' places and rates in q, v; the power lost, and
  // the power of prescribed joints. Gives the power lost but to the joints' viscous friction.
  Real record(Real *extra, const Real *force, const Real *q, const Real *v, const Real *etad,
              const Real &lost, const Real &prescribed) const {
    Real rest = lost;
    for (int j = 0; j < count; ++j) {
      const Joint &x = joints[static_cast<std::size_t>(j)];
      extra[j] = force[j] + x.kp * q[x.row] + x.kd * v[x.row];
      rest -= x.viscous * v[x.row] * v[x.row];
    }
    const Real all = rest;
    if (s.b.lossy) {
      for (int c = 0; c < s.chunks; ++c) put(square, c, get(etad, c) * get(etad, c));
      rest -= dot(s.n, s.b.material, square);
    }
    extra[count] = rest, extra[count + 1] = prescribed;
    return all;
  }

  // The rest of the loss in a row: it is another one in other modes.
  Real &rest_of(Real *extra) const { return extra[count]; }
  // Robots whose step just corrected has forces that are constant over all values looked back on,
  // and no loss: 1, else 0.
  Real steady() const {
    Real out = 0.0;
    for (int k = 0; k < LANES; ++k)
      if (lossless(k) && equal_values[k] >= s.count[k] - 1 && same(k)) set_lane(out, k, 1.0);
    return out;
  }
  // The accounts of such a step: the joints' places are q0 at its start, q1 at its end.
  Real steady_work(const Real *q0, const Real *q1) const {
    const Real *force = s.extra(s.new_row());
    Real work = 0.0;
    for (int j = 0; j < count; ++j) {
      const Joint &joint = joints[static_cast<std::size_t>(j)];
      const Real a = q0[joint.row], b = q1[joint.row];
      work += (force[j] - 0.5 * joint.kp * (b + a)) * (b - a);
    }
    return work;
  }
  // To be called before a robot's step is accepted, and when it begins with one value.
  void accept(int k) { equal_values[k] = same(k) ? equal_values[k] + 1 : 0; }
  void restart(int k) { equal_values[k] = 0; }

  // To be called when `DenseOutput` was built for a step of length h: what its integrals have in
  // common.
  void prepare(const Real &h) {
    for (int c = 0; c < chunks; ++c) {  // the polynomials through the numbers' last values and
                                        // their newest, and the uncertain part
      Lanes values[ORDER], pece_difference = get(s.extra(s.new_row()), c);
      for (int j = 0; j < ORDER; ++j)
        values[j] = get(s.extra(s.row(j)), c), pece_difference -= wide(s.ends[j]) * values[j];
      for (int m = 0; m < POWERS; ++m) {
        Lanes sum = wide(s.poly[m][GAP]) * pece_difference;
        for (int j = 0; j < ORDER; ++j) sum += wide(s.poly[m][j]) * values[j];
        put(U + m * room, c, sum),
            put(uncertain + m * room, c, wide(s.poly[m][OLDEST]) * pece_difference);
      }
    }
    of_joints<ORDER>(w.p + 1, P);
    for (int q = 0; q < ORDER; ++q)
      for (int c = 0; c < chunks; ++c) put(P + q * room, c, double(q + 1) * get(P + q * room, c));
    P[count] = P[count + 1] = h;  // powers are integrated over time itself
    turns = !w.damped.empty();
    for (int c = 0; c < s.chunks; ++c) turns = turns || w.oscillates(c);
  }

  // Integrals (101) from the start of the step of length h to its fraction x, where the joints'
  // places are q1; q0 at the start. whole: x = 1.
  Sums over(const Real &h, const Real &x, bool whole, const Real *q0, const Real *q1) {
    Sums sum{0.0, 0.0, 0.0, 0.0, 0.0};
    const bool of_all_modes = s.b.lossy || s.b.damped;
    if (turns || of_all_modes) free_motion(h, x, whole);
    if (turns) of_joints<POWERS>(L, Z);
    Real area[2 * POWERS], power = x;  // int_0^x x^k dx
    for (int k = 0; k < 2 * POWERS; ++k) area[k] = power * (1.0 / (k + 1)), power *= x;
    for (int c = 0; c < chunks; ++c) {
      Lanes all = 0.0, wrong = 0.0;
      for (int m = 0; m < POWERS; ++m) {
        Lanes moment = turns ? get(Z + m * room, c) : Lanes(0.0);
        for (int q = 0; q < ORDER; ++q) moment += get(P + q * room, c) * wide(area[m + q]);
        all += get(U + m * room, c) * moment;
        if (whole) wrong += get(uncertain + m * room, c) * moment;
      }
      put(total, c, all), put(error, c, wrong);
    }
    if (damped) square_rates(h, area);
    for (int j = 0; j < count; ++j) {
      const Joint &joint = joints[std::size_t(j)];
      const Real a = q0[joint.row], b = q1[joint.row];
      sum.work += total[j] - (0.5 * joint.kp * (b - a) * (b + a) + joint.kd * squares[j]);
      sum.loss += joint.viscous * squares[j];
      sum.work_error += error[j];
    }
    sum.loss += total[count], sum.loss_error += error[count];
    sum.work += total[count + 1], sum.work_error += error[count + 1];
    if (of_all_modes) of_modes(h, area, sum);
    return sum;
  }

  // To be called when modes were taken: the joints' rows of the modes, and their squares.
  void take_rows() {
    for (int j = 0; j < count; ++j)
      for (int k = 0; k < s.n; ++k) {
        const Real x = s.b.phi[k * s.stride + joints[std::size_t(j)].row];
        phi[k * room + j] = x, phi2[k * room + j] = x * x;
      }
  }

 private:
  const ExponentialAdams<Real> &s;
  const DenseOutput<Real> &w;
  std::vector<Joint> joints;
  const int count, chunks, room;  // of the extra numbers
  Block<Real> memory;
  Real *L[POWERS], *Qz;         // (stride): int x^m z' dt, int z'^2 dt
  Real *phi, *phi2;             // (n, room): of each joint phi_kj, and squared
  Real *U, *uncertain, *P, *Z;  // (powers, room) of the step, see above; P_q of the joints' rates,
                                // Z: Z_j's share of int x^m v_j dt
  Real *total, *error, *squares;  // (room) int u_j v_j dt, its uncertain part; int v_j^2 dt
  Real *square, *added;           // (stride) scratch; `square` is written by record() too
  long equal_values[LANES] = {};  // the last ones that have the newest's forces, of each robot
  bool damped_of[LANES] = {}, damped = false,
       turns = false;  // has any joint damping; does any mode have free motion in this step?

  // Is nothing lost by robot k, to friction, gains, material or added damping? (`rest`: see same.)
  bool lossless(int k) const { return !(damped_of[k] || s.b.lossy_of[k] || s.b.damped_of[k]); }

  // Are robot k's forces in the new row those of the newest one, and its powers zero in both?
  bool same(int k) const {
    const Real *now = s.extra(s.new_row()), *before = s.extra(s.newest());
    bool out = true;
    for (int j = 0; j < count; ++j) out = out && lane(now[j], k) == lane(before[j], k);
    for (int j = count; j < count + 2; ++j)
      out = out && lane(now[j], k) == 0.0 && lane(before[j], k) == 0.0;
    return out;
  }

  // The joints' part of several quantities of the modes: out (COUNT, room), sum_k phi_kj x_k.
  template <int COUNT>
  void of_joints(Real *const *x, Real *out) const {
    for (int c = 0; c < chunks; ++c) {
      Lanes sum[COUNT];
      for (Lanes &one : sum) one = 0.0;
      for (int k = 0; k < s.n; ++k) {
        const Lanes row = get(phi + k * room, c);
        for (int m = 0; m < COUNT; ++m) sum[m] += wide(x[m][k]) * row;
      }
      for (int m = 0; m < COUNT; ++m) put(out + m * room, c, sum[m]);
    }
  }

  // int v_j^2 dt of the joints.
  void square_rates(const Real &h, const Real *area) {
    const Lanes per = wide(1.0 / choose_less(Real(0.0), h, h, Real(1.0)));
    std::fill(squares, squares + room, Real(0.0));
    if (turns) add_rows(s.n, chunks, Qz, phi2, room, squares);
    for (int c = 0; c < chunks; ++c) {
      Lanes sum = get(squares, c);
      for (int q = 0; q < ORDER; ++q) {
        Lanes row = turns ? 2.0 * get(Z + q * room, c) : Lanes(0.0);
        for (int r = 0; r < ORDER; ++r) row += get(P + r * room, c) * wide(area[q + r]);
        sum += per * get(P + q * room, c) * row;
      }
      put(squares, c, sum);
    }
  }

  // L and Qz of z from 0 to x, from z at both ends: by parts, L_m = x^m z - m J_(m-1), and z'' + d2
  // z' + w2 z = 0 gives J_m = int x^m z dx.
  template <class Number>
  static void moments_of(Number w2, Number softness, Number d2, Number lifetime, Number per,
                         Number x, Number z0, Number zd0, Number z1, Number zd1, Number *moment,
                         Number &squares) {
    const Number inverse = per * softness;
    Number before = 0.0, J = 0.0, power = 1.0;
    for (int m = 0; m < POWERS; ++m) {
      const Number here = m ? power * z1 - double(m) * J : z1 - z0;
      J = -(d2 * here + power * zd1 - (m ? double(m) * per * before : zd0)) * inverse;
      moment[m] = before = here;
      power = power * x;
    }
    squares = 0.5 * lifetime * ((zd0 - zd1) * (zd0 + zd1) + w2 * (z0 - z1) * (z0 + z1));
  }

  void free_motion(const Real &h, const Real &x, bool whole) {
    const Lanes per = wide(1.0 / choose_less(Real(0.0), h, h, Real(1.0)));
    for (int c = 0; c < s.chunks; ++c) {
      if (!w.oscillates(c)) {
        for (Real *row : L) put(row, c, Lanes(0.0));
        put(Qz, c, Lanes(0.0));
        continue;
      }
      Lanes z, zd, moment[POWERS], squares;
      whole ? w.free_at_end(per, c, z, zd) : w.free_at(h, x, c, z, zd);
      moments_of(w.w2_of(c), w.softness_of(c), w.d2_of(c), w.lifetime_of(c), per, wide(x),
                 get(w.z0, c), get(w.zd0, c), z, zd, moment, squares);
      for (int m = 0; m < POWERS; ++m) put(L[m], c, moment[m]);
      put(Qz, c, squares);
    }
    for (const auto &one : w.damped) {
      const double own_h = lane(h, one.robot), own_x = lane(x, one.robot),
                   own_per = own_h > 0.0 ? 1.0 / own_h : 1.0;
      double moment[POWERS], squares, z, zd;
      if (whole)
        one.at_end(z, zd);
      else
        one.at(own_x * own_h, z, zd);
      if (one.both) {
        moments_of(one.w2, one.soft, one.d2, 1.0 / one.d2, own_per, own_x, one.z, one.zd, z, zd,
                   moment, squares);
      } else {  // z = z0 e^(-d2 t): int x^m z' dt = z x^m + ... by parts, upwards, d2 h being large
        double power = 1.0;
        for (int m = 0; m < POWERS; ++m) {
          moment[m] = m ? power * z + m * moment[m - 1] * one.soft * own_per : z - one.z;
          power *= own_x;
        }
        squares = 0.5 * one.d2 * (one.z - z) * (one.z + z);
      }
      for (int m = 0; m < POWERS; ++m) set_lane(L[m][one.mode], one.robot, moment[m]);
      set_lane(Qz[one.mode], one.robot, squares);
    }
  }

  // What the modes lose to the links' material and to the added damping.
  void of_modes(const Real &h, const Real *area, Sums &sum) {
    const Lanes per = wide(1.0 / choose_less(Real(0.0), h, h, Real(1.0)));
    for (int c = 0; c < s.chunks; ++c) {
      Lanes P[ORDER], squares = get(Qz, c), pumped = 0.0;
      for (int q = 0; q < ORDER; ++q) P[q] = double(q + 1) * get(w.p[q + 1], c);
      for (int q = 0; q < ORDER; ++q) {
        Lanes moment = get(L[q], c), row = moment + moment;  // moment: int x^q eta' dt
        for (int r = 0; r < ORDER; ++r) {
          const Lanes part = P[r] * wide(area[q + r]);
          row += part, moment += part;
        }
        squares += per * P[q] * row;
        pumped += double(q + 1) * per * get(w.f[q + 1], c) * moment;
      }
      const Lanes w2 = get(s.b.w2, c), lag = get(s.b.lag, c);
      put(square, c, squares), put(added, c, lag * (w2 * squares - pumped));
    }
    sum.loss += dot(s.n, s.b.material, square);
    for (int k = 0; k < s.n; ++k) sum.numerical += added[k];
  }
};

}  // namespace flexura
