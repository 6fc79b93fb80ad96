// The motion of the modes within a step just made.
//
// Over the step N is a polynomial, so a mode's motion is another polynomial in x = t/h and free motion about it:
//
//     eta(x) = sum_q p_q x^q + z(x),     z'' + d2 z' + w2 z = 0.
//
// Of a mode that oscillates p is what f alone makes of it (p_q = (f_q - (q+1) d2/h p_(q+1) - (q+1)(q+2)/h^2 p_(q+2)) / w2), exact however often
// it turns. A mode that turns by less than SLOW rad has Hermite's quintic for p, and no z. Strongly damped modes have one or both of
// their decays in z.
#pragma once
#include <array>

#include "adams.hpp"

namespace flexura {

template <class Real> class Within {
 public:
  static constexpr int LANES = LanesOf<Real>::value;
  static constexpr double SLOW2 = 0.1;  // SLOW squared: the quintic is then exact to 2e-8 of the mode's amplitude
  const Adams<Real> &s;
  Real *p[ORDER + 1], *f[ORDER + 1];  // (stride) polynomials: of the motion, of N
  Real *z0, *zd0;                     // (stride) z and z' at the start, of what oscillates

  // Of one strongly damped mode: z as a free motion with both decays, or with the fast one alone.
  struct Damped {
    int mode, robot;
    bool both;
    double w2, d2, z, zd;  // both: at the start; else z e^(-d2 t)
    void at(double t, double &y, double &v) const {
      if (both) {
        double g, dg;
        impulse_response(w2, d2, t, g, dg);
        y = (dg + d2 * g) * z + g * zd, v = dg * zd - w2 * g * z;
      } else {
        y = z * exp(-d2 * t), v = -d2 * y;
      }
    }
  };
  std::vector<Damped> damped;

  explicit Within(const Adams<Real> &steps) : s(steps) {
    memory.lay([this](auto take) {
      for (Real *&power : p) take(power, s.stride);
      for (Real *&power : f) take(power, s.stride);
      for (Real **vector : {&z0, &zd0, &safe_w2, &safe_d2, &safe_wave}) take(*vector, s.stride);
    });
    damped.reserve(static_cast<std::size_t>(s.n * LANES));
    waves.assign(static_cast<std::size_t>(s.chunks), 0), all_waves = waves;
  }

  // The highest power in p of a chunk.
  int degree(int chunk) const { return all_waves[static_cast<std::size_t>(chunk)] ? s.order_of(chunk) : ORDER; }
  bool oscillates(int chunk) const { return waves[static_cast<std::size_t>(chunk)] != 0; }

  // The step of length h just corrected; 0: the state at its start.
  void build(const Real &h) {
    damped.clear();
    for (int c = 0; c < s.chunks; ++c) build_chunk(wide(choose_less(Real(0.0), h, h, Real(1.0))), c);
  }

  // z, z' of the modes of a chunk at the fraction x (those that oscillate; damped ones: see `damped`).
  void free_at(const Real &h, const Real &x, int c, Lanes &z, Lanes &zd) const {
    const Lanes w2 = get(safe_w2, c), d2 = get(safe_d2, c), z_ = get(z0, c), zd_ = get(zd0, c);
    Lanes g, dg;
    impulse_responses(w2, d2, wide(x) * wide(h), g, dg);
    z = (dg + d2 * g) * z_ + g * zd_, zd = dg * zd_ - w2 * g * z_;
  }
  void free_at_end(const Real &h, int c, Lanes &z, Lanes &zd) const {  // from the corrected state
    const Lanes H = wide(choose_less(Real(0.0), h, h, Real(1.0))), wave = get(safe_wave, c);
    Lanes e = get(p[ORDER], c), d = 0.0;
    for (int q = ORDER - 1; q >= 0; --q) d = d + e, e = e + get(p[q], c);
    z = wave * (get(s.corrected[0], c) - e), zd = wave * (get(s.corrected[1], c) - d / H);
  }
  Lanes w2_of(int c) const { return get(safe_w2, c); }
  Lanes d2_of(int c) const { return get(safe_d2, c); }

  // eta, eta' (stride) at the fraction x.
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
  Real *safe_w2, *safe_d2, *safe_wave;  // (stride) of what oscillates, else 1 and 0; 1 where it does
  std::vector<char> waves, all_waves;  // (chunks) does any mode oscillate, do all?

  enum class Kind { slow, wave, decay, decays };
  static Kind kind_of(double w2, double d2, double h) {
    const double x2 = w2 * h * h, dd = d2 * h;
    if (dd * dd < 3.9 * x2) return x2 < SLOW2 ? Kind::slow : Kind::wave;
    const double half = 0.5 * dd, kappa = half * half > x2 ? root(half * half - x2) : 0.0;
    const double fast = half + kappa, slow = x2 / fast;  // rates of decay in a step
    return slow >= 0.3 ? Kind::decays : fast >= 1.0 ? Kind::decay : Kind::slow;
  }

  void build_chunk(Lanes h, int c) {
    const Adams<Real> &a = s;
    const Lanes w2 = get(a.b.w2, c), d2 = get(a.b.d2, c), lag = get(a.b.lag, c), per = 1.0 / h, behind = lag * per;
    Lanes wave = 0.0;
    Kind kinds[4];
    bool forced = worst(lag) > 0.0;  // is N needed as a polynomial?
    for (int l = 0; l < 4; ++l) {
      kinds[l] = kind_of(w2[l], d2[l], h[l]);
      if (kinds[l] == Kind::wave) wave.set(l, 1.0);
      forced = forced || kinds[l] != Kind::slow;
    }
    const bool any = worst(wave) > 0.0, all = least(wave) > 0.0;
    waves[static_cast<std::size_t>(c)] = any, all_waves[static_cast<std::size_t>(c)] = all;
    const Lanes y = get(a.eta, c), v = get(a.etad, c), y1 = get(a.corrected[0], c), v1 = get(a.corrected[1], c);
    Lanes F[ORDER + 2], P[ORDER + 3];
    const Lanes gap = get(a.gap, c);
    const int order = forced ? a.order_of(c) : -1;
    for (int q = order + 1; q <= ORDER; ++q) F[q] = P[q] = 0.0, put(f[q], c, Lanes(0.0));
    for (int q = 0; q <= order; ++q) {
      Lanes sum = a.coefficient(GAP, q, c) * gap;
      for (int j = 0; j < order; ++j) sum += a.coefficient(j, q, c) * get(a.N[a.row(j)], c);
      F[q] = sum, put(f[q], c, sum);
    }
    F[ORDER + 1] = 0.0;
    if (!all) {  // Hermite's quintic
      Lanes slope = 0.0;
      for (int q = ORDER; q > 0; --q) slope += double(q) * F[q];  // of N at x = 1
      const Lanes dy = y1 - y, b0 = h * v, b1 = h * v1;
      const Lanes a0 = h * h * (get(a.N[a.row(0)], c) + behind * F[1] - w2 * y - d2 * v);
      const Lanes a1 = h * h * (get(a.N[a.new_row()], c) + behind * slope - w2 * y1 - d2 * v1);
      P[0] = y, P[1] = b0, P[2] = 0.5 * a0;
      P[3] = 10.0 * dy - 6.0 * b0 - 4.0 * b1 - 1.5 * a0 + 0.5 * a1;
      P[4] = -15.0 * dy + 8.0 * b0 + 7.0 * b1 + 1.5 * a0 - a1;
      P[5] = 6.0 * dy - 3.0 * b0 - 3.0 * b1 - 0.5 * a0 + 0.5 * a1;
    }
    if (any) {  // what f alone makes of a mode that oscillates
      const Lanes W = choose_less(Lanes(0.5), wave, w2, Lanes(1.0)), D = choose_less(Lanes(0.5), wave, d2, Lanes(0.0));
      const Lanes inverse = 1.0 / W, drag = D * per, bend = inverse * per * per;
      Lanes above = 0.0, here = 0.0;
      for (int q = all ? order : ORDER; q >= 0; --q) {
        const Lanes force = F[q] + double(q + 1) * behind * F[q + 1];
        const Lanes below = inverse * (force - double(q + 1) * drag * here) - double((q + 1) * (q + 2)) * bend * above;
        above = here, here = below;
        P[q] = all ? below : choose_less(Lanes(0.5), wave, below, P[q]);
      }
      put(safe_w2, c, W), put(safe_d2, c, D), put(safe_wave, c, wave);
      put(z0, c, wave * (y - P[0])), put(zd0, c, wave * (v - P[1] * per));
    } else {
      put(z0, c, Lanes(0.0)), put(zd0, c, Lanes(0.0));
    }
    for (int q = 0; q <= ORDER; ++q) put(p[q], c, P[q]);
    for (int l = 0; l < 4; ++l)
      if (kinds[l] == Kind::decay || kinds[l] == Kind::decays) build_damped(c, l, kinds[l] == Kind::decays, h[l], w2[l], d2[l], F, behind[l]);
  }

  // One strongly damped mode: p and z from the polynomial of f.
  void build_damped(int c, int l, bool both, double h, double w2, double d2, const Lanes *F, double behind) {
    const int mode = LANES == 1 ? 4 * c + l : c, robot = LANES == 1 ? 0 : l;
    if (mode >= s.n) return;
    auto of = [robot](const Real *at, int i) { return lane(at[i], robot); };
    double force[ORDER + 3] = {}, q_[ORDER + 3] = {};
    for (int q = 0; q <= ORDER; ++q) force[q] = F[q][l] + (q + 1) * behind * (q < ORDER ? F[q + 1][l] : 0.0);
    const double y = of(s.eta, mode), v = of(s.etad, mode), y1 = of(s.corrected[0], mode), v1 = of(s.corrected[1], mode);
    Damped one{mode, robot, both, w2, d2, 0.0, 0.0};
    if (both) {
      for (int q = ORDER; q >= 0; --q)
        q_[q] = (force[q] - (q + 1) * d2 / h * q_[q + 1] - (q + 1) * (q + 2) / (h * h) * q_[q + 2]) / w2;
      one.z = y - q_[0], one.zd = v - q_[1] / h;
    } else {  // u = eta' + slow eta obeys u' + fast u = f: its own decay is the fast one, c_u e^(-fast t), and -c_u / (fast - slow) that of eta
      const double half = 0.5 * d2, kappa = root(half * half - w2), fast = half + kappa, slow = w2 / fast;
      double u = 0.0;
      for (int q = ORDER; q >= 0; --q) u = (force[q] - (q + 1) / h * u) / fast;
      one.d2 = fast, one.z = -(v + slow * y - u) / (fast - slow);
      const double e = one.z * exp(-fast * h);
      double end = 0.0;
      for (int q = 0; q <= ORDER; ++q) end += force[q];
      auto smooth = [&](double place, double rate, double acceleration, double decay) {  // without the decay: place, rate, bend in x
        return std::array<double, 3>{place - decay, h * (rate + fast * decay), h * h * (acceleration - fast * fast * decay)};
      };
      const auto a = smooth(y, v, force[0] - d2 * v - w2 * y, one.z), b = smooth(y1, v1, end - d2 * v1 - w2 * y1, e);
      const double dy = b[0] - a[0];
      q_[0] = a[0], q_[1] = a[1], q_[2] = 0.5 * a[2], q_[3] = 10.0 * dy - 6.0 * a[1] - 4.0 * b[1] - 1.5 * a[2] + 0.5 * b[2];
      q_[4] = -15.0 * dy + 8.0 * a[1] + 7.0 * b[1] + 1.5 * a[2] - b[2], q_[5] = 6.0 * dy - 3.0 * a[1] - 3.0 * b[1] - 0.5 * a[2] + 0.5 * b[2];
    }
    for (int q = 0; q <= ORDER; ++q) set_lane(p[q][mode], robot, q_[q]);
    damped.push_back(one);
  }
};

}  // namespace flexura
