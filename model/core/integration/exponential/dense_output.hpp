// The motion of the modes within a step just made (98).
//
// Over the step N is a polynomial, so a mode's motion is another polynomial in x = t/h and free
// motion about it:
//
//     eta(x) = sum_q p_q x^q + z(x),     z'' + d2 z' + w2 z = 0.
//
// Of a mode that oscillates p is what f alone makes of it (p_q = (f_q - (q+1) d2/h p_(q+1) -
// (q+1)(q+2)/h^2 p_(q+2)) / w2), exact however often it turns. A mode that turns by less than SLOW
// rad has Hermite's quintic for p, and no z. Strongly damped modes have one or both of their decays
// in z.
#pragma once
#include <algorithm>
#include <array>

#include "integration/exponential/predictor_corrector.hpp"

namespace flexura {

template <class Real>
class DenseOutput {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  static constexpr double SLOW2 =
      0.1;  // SLOW squared: the quintic is then exact to 2e-8 of the mode's amplitude
  const ExponentialAdams<Real> &s;
  Real *p[ORDER + 1], *f[ORDER + 1];  // (stride) polynomials: of the motion, of N
  Real *z0, *zd0;                     // (stride) z and z' at the start, of what oscillates

  // Of one strongly damped mode: z as a free motion with both decays, or with the fast one alone.
  struct Damped {
    int mode, robot;
    bool both;
    double w2, d2, soft;  // both; else the fast decay for d2. soft: 1 / w2, or 1 / d2
    double slow, apart;   // of the fast one alone: the other decay, 1 / (fast - slow)
    double stay, come,
        sink;  // over the whole step: z from z and from z', z' from z (and from z': stay - d2 come)
    double z = 0.0, zd = 0.0;  // at the start

    Damped(int its_mode, int its_robot, bool with_both, double square, double decay, double h)
        : mode(its_mode),
          robot(its_robot),
          both(with_both),
          w2(square),
          d2(decay),
          soft(1.0 / square),
          slow(0.0),
          apart(0.0),
          come(0.0),
          sink(0.0) {
      if (both) {
        double dg;
        impulse_response(w2, d2, h, come, dg);
        stay = dg + d2 * come, sink = -w2 * come;
        return;
      }
      const double half = 0.5 * decay, kappa = root(half * half - square);
      d2 = half + kappa, slow = square / d2, apart = 0.5 / kappa, soft = 1.0 / d2,
      stay = exp(-d2 * h);
    }
    void at(double t, double &y, double &v) const {
      if (both) {
        double g, dg;
        impulse_response(w2, d2, t, g, dg);
        y = (dg + d2 * g) * z + g * zd, v = dg * zd - w2 * g * z;
      } else {
        y = z * exp(-d2 * t), v = -d2 * y;
      }
    }
    void at_end(double &y, double &v) const {
      y = stay * z + come * zd;
      v = both ? sink * z + (stay - d2 * come) * zd : -d2 * y;
    }
  };
  std::vector<Damped> damped;

  explicit DenseOutput(const ExponentialAdams<Real> &steps) : s(steps) {
    memory.lay([this](auto take) {
      for (Real *&power : p) take(power, s.stride);
      for (Real *&power : f) take(power, s.stride);
      for (Real **vector : {&z0, &zd0, &w2, &d2, &wave, &softness, &drag, &softness_hh, &lifetime})
        take(*vector, s.stride);
    });
    damped.reserve(static_cast<std::size_t>(s.n * LANES));
    tables.resize(static_cast<std::size_t>(s.chunks));
  }

  bool oscillates(int chunk) const { return of(chunk).any; }

  // What depends on the modes and on the length h of the step alone; 0: the state at its start.
  void tabulate(const Real &h) {
    damped.clear();
    for (int c = 0; c < s.chunks; ++c)
      tabulate_chunk(wide(choose_less(Real(0.0), h, h, Real(1.0))), c);
  }

  // The step of length h just corrected.
  void build(const Real &h) {
    const Real length = choose_less(Real(0.0), h, h, Real(1.0));
    for (int c = 0; c < s.chunks; ++c) build_chunk(wide(length), wide(1.0 / length), c);
    for (Damped &one : damped) build_damped(one, lane(length, one.robot));
  }

  // z, z' of the modes of a chunk at the fraction x (those that oscillate; damped ones: see
  // `damped`).
  void free_at(const Real &h, const Real &x, int c, Lanes &z, Lanes &zd) const {
    const Lanes square = get(w2, c), decay = get(d2, c), z_ = get(z0, c), zd_ = get(zd0, c);
    Lanes g, dg;
    impulse_responses(square, decay, wide(x) * wide(h), g, dg);
    z = (dg + decay * g) * z_ + g * zd_, zd = dg * zd_ - square * g * z_;
  }
  void free_at_end(const Lanes &per, int c, Lanes &z,
                   Lanes &zd) const {  // from the corrected state; per: 1/h
    const Lanes turning = get(wave, c);
    Lanes e = get(p[ORDER], c), d = 0.0;
    for (int q = ORDER - 1; q >= 0; --q) d = d + e, e = e + get(p[q], c);
    z = turning * (get(s.corrected[0], c) - e), zd = turning * (get(s.corrected[1], c) - d * per);
  }
  Lanes w2_of(int c) const { return get(w2, c); }
  Lanes d2_of(int c) const { return get(d2, c); }
  Lanes softness_of(int c) const { return get(softness, c); }  // 1 / w2
  Lanes lifetime_of(int c) const { return get(lifetime, c); }  // 1 / d2; 0: without damping

  // eta, eta' (98) (stride) at the fraction x.
  void at(const Real &h, const Real &x, Real *y, Real *v) const {
    const Lanes X = wide(x), per = wide(1.0 / choose_less(Real(0.0), h, h, Real(1.0)));
    for (int c = 0; c < s.chunks; ++c) {
      Lanes e = get(p[ORDER], c), d = 0.0;
      for (int q = ORDER - 1; q >= 0; --q) d = d * X + e, e = e * X + get(p[q], c);
      d = d * per;
      if (oscillates(c)) {
        Lanes z, zd;
        free_at(h, x, c, z, zd);
        e += z, d += zd;
      }
      put(y, c, e), put(v, c, d);
    }
    for (const Damped &one : damped) {
      double e, d;
      one.at(lane(x, one.robot) * lane(h, one.robot), e, d);
      set_lane(y[one.mode], one.robot, lane(y[one.mode], one.robot) + e);
      set_lane(v[one.mode], one.robot, lane(v[one.mode], one.robot) + d);
    }
  }

 private:
  Block<Real> memory;
  // (stride) of what oscillates, else 1 and 0: w2, d2; 1 where it does; 1 / w2, d2 / h, 1 / (w2
  // h^2), 1 / d2.
  Real *w2, *d2, *wave, *softness, *drag, *softness_hh, *lifetime;

  enum class Kind { slow, wave, decay, decays };
  static Kind kind_of(double w2, double d2, double h) {
    const double x2 = w2 * h * h, dd = d2 * h;
    if (dd * dd < 3.9 * x2) return x2 < SLOW2 ? Kind::slow : Kind::wave;
    const double half = 0.5 * dd, kappa = half * half > x2 ? root(half * half - x2) : 0.0;
    const double fast = half + kappa, slow = x2 / fast;  // rates of decay in a step
    return slow >= 0.3 ? Kind::decays : fast >= 1.0 ? Kind::decay : Kind::slow;
  }

  // Of the modes of a chunk: does any oscillate, do all, is N needed as a polynomial?
  struct Table {
    bool any = false, all = false, forced = false;
  };
  std::vector<Table> tables;  // (chunks)
  const Table &of(int chunk) const { return tables[static_cast<std::size_t>(chunk)]; }

  void tabulate_chunk(Lanes h, int c) {
    const Lanes square = get(s.b.w2, c), decay = get(s.b.d2, c), per = 1.0 / h;
    Table &t = tables[static_cast<std::size_t>(c)];
    Lanes turning = 0.0;
    t.forced = worst(get(s.b.lag, c)) > 0.0;
    for (int l = 0; l < 4; ++l) {
      const Kind kind = kind_of(square[l], decay[l], h[l]);
      if (kind == Kind::wave) turning.set(l, 1.0);
      t.forced = t.forced || kind != Kind::slow;
      const int mode = LANES == 1 ? 4 * c + l : c;
      if (mode < s.n && (kind == Kind::decay || kind == Kind::decays))
        damped.emplace_back(mode, LANES == 1 ? 0 : l, kind == Kind::decays, square[l], decay[l],
                            h[l]);
    }
    t.any = worst(turning) > 0.0, t.all = least(turning) > 0.0;
    const Lanes W = choose_less(Lanes(0.5), turning, square, Lanes(1.0)),
                D = choose_less(Lanes(0.5), turning, decay, Lanes(0.0));
    put(w2, c, W), put(d2, c, D), put(wave, c, turning), put(softness, c, 1.0 / W),
        put(drag, c, D * per);
    put(softness_hh, c, per * per / W);
    put(lifetime, c,
        choose_less(Lanes(0.0), D, 1.0 / choose_less(Lanes(0.0), D, D, Lanes(1.0)), Lanes(0.0)));
    put(z0, c, Lanes(0.0)), put(zd0, c, Lanes(0.0));
  }

  void build_chunk(Lanes h, Lanes per, int c) {
    const ExponentialAdams<Real> &a = s;
    const Table &t = of(c);
    const Lanes behind = get(a.b.lag, c) * per;
    const Lanes y = get(a.eta, c), v = get(a.etad, c), y1 = get(a.corrected[0], c),
                v1 = get(a.corrected[1], c);
    Lanes F[ORDER + 2], P[ORDER + 3];
    if (t.forced)
      a.force_polynomial(c, F);
    else
      std::fill(F, F + ORDER + 1, Lanes(0.0));
    for (int q = 0; q <= ORDER; ++q) put(f[q], c, F[q]);
    F[ORDER + 1] = 0.0;
    if (!t.all) {  // Hermite's quintic
      const Lanes square = get(a.b.w2, c), decay = get(a.b.d2, c);
      Lanes slope = 0.0;
      for (int q = ORDER; q > 0; --q) slope += double(q) * F[q];  // of N at x = 1
      const Lanes dy = y1 - y, b0 = h * v, b1 = h * v1;
      const Lanes a0 = h * h * (get(a.N[a.row(0)], c) + behind * F[1] - square * y - decay * v);
      const Lanes a1 =
          h * h * (get(a.N[a.new_row()], c) + behind * slope - square * y1 - decay * v1);
      P[0] = y, P[1] = b0, P[2] = 0.5 * a0;
      P[3] = 10.0 * dy - 6.0 * b0 - 4.0 * b1 - 1.5 * a0 + 0.5 * a1;
      P[4] = -15.0 * dy + 8.0 * b0 + 7.0 * b1 + 1.5 * a0 - a1;
      P[5] = 6.0 * dy - 3.0 * b0 - 3.0 * b1 - 0.5 * a0 + 0.5 * a1;
    }
    if (t.any) {  // what f alone makes of a mode that oscillates
      const Lanes turning = get(wave, c), soft = get(softness, c), slowed = soft * get(drag, c),
                  bend = get(softness_hh, c);
      Lanes above = 0.0, here = 0.0;
      for (int q = ORDER; q >= 0; --q) {
        const Lanes force = F[q] + double(q + 1) * behind * F[q + 1];
        const Lanes below =
            soft * force - double(q + 1) * slowed * here - double((q + 1) * (q + 2)) * bend * above;
        above = here, here = below;
        P[q] = t.all ? below : choose_less(Lanes(0.5), turning, below, P[q]);
      }
      put(z0, c, turning * (y - P[0])), put(zd0, c, turning * (v - P[1] * per));
    }
    for (int q = 0; q <= ORDER; ++q) put(p[q], c, P[q]);
  }

  // One strongly damped mode: p and z from the polynomial of f.
  void build_damped(Damped &one, double h) {
    auto of = [&](const Real *at) { return lane(at[one.mode], one.robot); };
    const double per = 1.0 / h, behind = of(s.b.lag) * per;
    double force[ORDER + 3] = {}, q_[ORDER + 3] = {};
    for (int q = 0; q <= ORDER; ++q)
      force[q] = of(f[q]) + (q + 1) * behind * (q < ORDER ? of(f[q + 1]) : 0.0);
    const double y = of(s.eta), v = of(s.etad), y1 = of(s.corrected[0]), v1 = of(s.corrected[1]);
    if (one.both) {
      for (int q = ORDER; q >= 0; --q)
        q_[q] = one.soft * (force[q] - (q + 1) * one.d2 * per * q_[q + 1] -
                            (q + 1) * (q + 2) * per * per * q_[q + 2]);
      one.z = y - q_[0], one.zd = v - q_[1] * per;
    } else {  // u = eta' + slow eta obeys u' + fast u = f: its own decay is the fast one, c_u
              // e^(-fast t), and -c_u / (fast - slow) that of eta
      const double fast = one.d2, square = of(s.b.w2), decay = of(s.b.d2);
      double u = 0.0, end = 0.0;
      for (int q = ORDER; q >= 0; --q)
        u = one.soft * (force[q] - (q + 1) * per * u), end += force[q];
      one.z = -(v + one.slow * y - u) * one.apart;
      auto smooth = [&](double place, double rate, double acceleration,
                        double part) {  // without the decay: place, rate, bend in x
        return std::array<double, 3>{place - part, h * (rate + fast * part),
                                     h * h * (acceleration - fast * fast * part)};
      };
      const auto a = smooth(y, v, force[0] - decay * v - square * y, one.z);
      const auto b = smooth(y1, v1, end - decay * v1 - square * y1, one.z * one.stay);
      const double dy = b[0] - a[0];
      q_[0] = a[0], q_[1] = a[1], q_[2] = 0.5 * a[2],
      q_[3] = 10.0 * dy - 6.0 * a[1] - 4.0 * b[1] - 1.5 * a[2] + 0.5 * b[2];
      q_[4] = -15.0 * dy + 8.0 * a[1] + 7.0 * b[1] + 1.5 * a[2] - b[2],
      q_[5] = 6.0 * dy - 3.0 * a[1] - 3.0 * b[1] - 0.5 * a[2] + 0.5 * b[2];
    }
    for (int q = 0; q <= ORDER; ++q) set_lane(p[q][one.mode], one.robot, q_[q]);
  }
};

}  // namespace flexura
