// Exponential steps of Adams' kind: predictor (91) and corrector (92). The linear part of each mode
// is solved exactly (89).
//
// With y = origin + sum_k eta_k phi_k the equations of motion are
//
//     eta'' + own eta' + w2 eta = N,      N = rows a + own eta' + w2 eta,
//
// a the accelerations of a pass (88): exact, whatever the modes. N varies with the motion and not
// with the vibration. A polynomial in time through its last values goes into the
// variation-of-constants formula of each mode (oscillator.hpp), the equations are looked at once
// where that leads, and the polynomial through the new value too makes the step: predict, evaluate,
// correct (exponential multistep methods: Hochbruck, Ostermann, Acta Numerica 19 (2010), 2.5). The
// error is estimated as Shampine and Gordon do, by leaving out the oldest value (93). Steps need
// not resolve any frequency of the robot.
//
// Damping that is added to modes above a cutoff acts on the motion about the quasi-static one (95),
// N / w2:
//
//     eta'' + own eta' + added (eta' - N' / w2) + w2 eta = N,   so   d2 = own + added,   f = N +
//     lag N', lag = added / w2.
#pragma once
#include "integration/exponential/force_polynomials.hpp"
#include "integration/exponential/modal_basis.hpp"
#include "integration/exponential/oscillator.hpp"

namespace flexura {

template <class Real>
class ExponentialAdams {
 public:
  static constexpr int LANES = LanesOf<Real>::value, ROWS = ORDER + 1;

  // Lengths of steps that differ by less than this part of the time are one: what is left to a
  // tick.
  static constexpr double ALIKE = 1e-15;

  const ModalBasis<Real> &b;
  const int n, chunks, stride;
  Real *eta, *etad;  // (stride) the state at the start of the step
  Real *N[ROWS];  // (stride + extras) the last values, row(age); behind them other numbers found at
                  // the same times
  Real *predicted[2], *corrected[2];  // (stride) eta, eta' at its end
  Real *pece_difference;              // (stride) new less extrapolated N
  Real *corrector_weights[4];  // (stride) what a gap adds to eta, eta'; its share that is uncertain
  Real poly[ORDER + 1][COLUMNS];  // [power][value by age, GAP, OLDEST] (force_polynomials.hpp)
  Real ends[ORDER];               // the values' polynomials at the end of the step
  Real time[ROWS];
  int count[LANES], equal_steps[LANES];  // values held; steps since the length of the step changed

  const int extras;

  ExponentialAdams(const ModalBasis<Real> &modes, int extra_numbers)
      : b(modes), n(modes.n), chunks(modes.chunks), stride(modes.stride), extras(extra_numbers) {
    memory.lay([this](auto take) {
      auto vectors = [&](auto &...all) { (take(all, stride), ...); };
      vectors(eta, etad, predicted[0], predicted[1], corrected[0], corrected[1], pece_difference);
      for (auto *group : {corrector_weights, step})
        for (int r = 0; r < 4; ++r) take(group[r], stride);
      for (Real *&row_ : N) take(row_, stride + room_of<Real>(extras));
      for (auto &table : predictor_weights)
        for (Real *&row_ : table) take(row_, stride);
      take(A, POWERS * stride), take(B, POWERS * stride);
    });
    one.lay([this](auto take) {
      for (double **vector : {&w2, &d2, &lag}) take(*vector, padded(n));
      take(one_step, 4 * padded(n)), take(one_A, POWERS * padded(n)),
          take(one_B, POWERS * padded(n));
    });
    for (auto &x : time) x = 0.0;
    for (int k = 0; k < LANES; ++k) count[k] = 0, equal_steps[k] = 0, span[k] = -1.0;
    for (auto &power : poly)
      for (Real &x : power) x = 0.0;
    for (Real &x : ends) x = 0.0;
  }

  Real *extra(int row_) { return N[row_] + stride; }
  const Real *extra(int row_) const { return N[row_] + stride; }
  int row(int age) const { return head + age < ROWS ? head + age : head + age - ROWS; }
  int new_row() const { return row(ROWS - 1); }
  int newest() const { return head; }

  // Of the step that the tables of a robot, of all robots are for: of one whose tables stay, less
  // by round-off than the step's own.
  double length(int k) const { return span[k]; }
  Real lengths() const {
    Real out = 0.0;
    for (int k = 0; k < LANES; ++k) set_lane(out, k, span[k]);
    return out;
  }

  // Has robot k's last step led to the time t, or to the instant before it?
  bool reached(int k, double t) const {
    const double newest = lane(time[head], k);
    return count[k] > 0 && newest <= t && t <= std::nextafter(newest, t);
  }

  // Robot k has one value, that of the new row, and modes that are new.
  void restart(int k, double t) {
    copy_row(k, new_row(), head);
    count[k] = 1, set_lane(time[head], k, t), span[k] = -1.0;
  }

  // At a jump of what acts: robot k's newest value becomes that of the new row, and the older ones
  // are shifted by the same jump; all but the last `still` numbers of a row.
  void shift_history(int k, double t, int still) {
    for (int i = 0; i < stride + extras - still; ++i) {
      const double jump = lane(N[new_row()][i], k) - lane(N[head][i], k);
      for (int age = 1; age < count[k]; ++age)
        set_lane(N[row(age)][i], k, lane(N[row(age)][i], k) + jump);
    }
    copy_row(k, new_row(), head);
    set_lane(time[head], k, t);
  }
  void forget_tables(int k) { span[k] = -1.0; }

  // The tables of a step of length h from the time t; 0: nothing moves. True: of any robot the
  // length or the modes are new.
  bool tabulate(const Real &t, const Real &h) {
    Real changed = 0.0;
    bool any = false, fresh = false;
    for (int k = 0; k < LANES; ++k) {
      const double own = lane(h, k);
      if (!(abs(own - span[k]) <= ALIKE * abs(lane(t, k))) || (own == 0.0) != (span[k] == 0.0))
        tabulate_modes(k, own), span[k] = own, equal_steps[k] = 0, fresh = true;
      else if (equal_steps[k] > ORDER)
        continue;
      set_lane(changed, k, 1.0), any = true;
    }
    if (!any) return false;
    Real node[ORDER];
    const Real moving = choose_less(Real(0.0), h, h, Real(1.0));
    for (int j = 0; j < ORDER; ++j)
      node[j] = choose_less(Real(0.0), h, (time[row(j)] - time[head]) / moving, Real(-double(j)));
    polynomials(changed, node);
    for (int c = 0; c < chunks; ++c) weigh_values(wide(changed), c);
    return fresh;
  }

  // The predictor (91): where a step leads without a look at the equations; minus that N in
  // `pece_difference`.
  void predict() {
    int most = 0;
    for (int k = 0; k < LANES; ++k) most = count[k] > most ? count[k] : most;
    for (int c = 0; c < chunks; ++c) {
      const Lanes y = get(eta, c), v = get(etad, c);
      Lanes p = get(step[0], c) * y + get(step[1], c) * v,
            q = get(step[2], c) * y + get(step[3], c) * v, g = 0.0;
      for (int j = 0; j < most; ++j) {
        const Lanes value = get(N[row(j)], c);
        p += get(predictor_weights[0][j], c) * value, q += get(predictor_weights[1][j], c) * value,
            g -= wide(ends[j]) * value;
      }
      put(predicted[0], c, p), put(predicted[1], c, q), put(pece_difference, c, g);
    }
  }

  // N of (88) from the n accelerations a at a state of the modes, into `out`.
  void force(const Real *a, const Real *y, const Real *v, Real *out) const {
    for (int c = 0; c < chunks; ++c)
      put(out, c, get(b.w2, c) * get(y, c) + get(b.own, c) * get(v, c));
    add_rows(n, chunks, a, b.rows, stride, out);
  }

  // The corrector (92): the step, with N found where `predict` led, in the new row.
  void correct() {
    const Real *found = N[new_row()];
    for (int c = 0; c < chunks; ++c) {
      const Lanes g = get(pece_difference, c) + get(found, c);
      put(pece_difference, c, g);
      put(corrected[0], c, get(predicted[0], c) + get(corrector_weights[0], c) * g);
      put(corrected[1], c, get(predicted[1], c) + get(corrector_weights[1], c) * g);
    }
  }

  // Robots `which` go on from the end of their steps at the times t.
  void accept(const Real &which, const Real &t) {
    const Lanes go = wide(which);
    for (int c = 0; c < chunks; ++c) {
      put(eta, c, choose_less(Lanes(0.5), go, get(corrected[0], c), get(eta, c)));
      put(etad, c, choose_less(Lanes(0.5), go, get(corrected[1], c), get(etad, c)));
    }
    head = new_row();
    time[head] = t;
    for (int k = 0; k < LANES; ++k) {
      if (lane(which, k) > 0.5) {
        if (count[k] < ORDER) ++count[k];
        ++equal_steps[k];
      } else {  // its values keep their ages
        for (int age = 0; age < ORDER; ++age) {
          const int to = row(age), from = row(age + 1);
          set_lane(time[to], k, lane(time[from], k));
          copy_row(k, from, to);
        }
      }
    }
  }

  // The polynomial of N over the step, of the modes of a chunk: F (ORDER + 1).
  void force_polynomial(int c, Lanes *F) const {
    Lanes value[ORDER];
    const Lanes g = get(pece_difference, c);
    for (int j = 0; j < ORDER; ++j) value[j] = get(N[row(j)], c);
    for (int q = 0; q <= ORDER; ++q) {
      Lanes sum = wide(poly[q][GAP]) * g;
      for (int j = 0; j < ORDER; ++j) sum += wide(poly[q][j]) * value[j];
      F[q] = sum;
    }
  }

 private:
  void copy_row(int k, int from, int to) {
    for (int i = 0; i < stride + extras; ++i) set_lane(N[to][i], k, lane(N[from][i], k));
  }

  Block<Real> memory;
  Block<double> one;  // one robot's, for tabulate_modes
  Real *step[4], *A, *B,
      *predictor_weights[2][ORDER];  // free motion; moments; weights of old values in eta, eta'
  double *w2, *d2, *lag, *one_step, *one_A, *one_B;
  double span[LANES];  // length of the step that the tables are for
  int head = 0;

  // Free motion and moments of robot k's modes over a step of h.
  void tabulate_modes(int k, double h) {
    const int room = padded(n);
    for (int i = 0; i < n; ++i)
      w2[i] = lane(b.w2[i], k), d2[i] = lane(b.d2[i], k), lag[i] = lane(b.lag[i], k);
    if (h > 0.0) propagate(room / 4, room, w2, d2, lag, h, one_step, one_A, one_B);
    for (int i = 0; i < n; ++i) {
      for (int r = 0; r < 4; ++r)
        set_lane(step[r][i], k, h > 0.0 ? one_step[r * room + i] : r == 0 || r == 3 ? 1.0 : 0.0);
      for (int m = 0; m < POWERS; ++m) {
        set_lane(A[m * stride + i], k, h > 0.0 ? one_A[m * room + i] : 0.0);
        set_lane(B[m * stride + i], k, h > 0.0 ? one_B[m * room + i] : 0.0);
      }
    }
  }

  // Polynomials through the values that each robot holds, for the robots that changed.
  void polynomials(const Real &changed, const Real *node) {
    bool alike = true;
    for (int k = 1; k < LANES; ++k) alike = alike && count[k] == count[0];
    if (alike) {
      Real C[ORDER + 1][COLUMNS];
      interpolate(count[0], node, C);
      for (int m = 0; m <= ORDER; ++m)
        for (int j = 0; j <= OLDEST; ++j)
          poly[m][j] = choose_less(Real(0.5), changed, C[m][j], poly[m][j]);
    } else {
      for (int k = 0; k < LANES; ++k) {
        if (lane(changed, k) < 0.5) continue;
        double own[ORDER], C[ORDER + 1][COLUMNS];
        for (int j = 0; j < ORDER; ++j) own[j] = lane(node[j], k);
        interpolate(count[k], own, C);
        for (int m = 0; m <= ORDER; ++m)
          for (int j = 0; j <= OLDEST; ++j) set_lane(poly[m][j], k, C[m][j]);
      }
    }
    for (int j = 0; j < ORDER; ++j) {
      ends[j] = 0.0;
      for (int m = 0; m < ORDER; ++m) ends[j] += poly[m][j];
    }
  }

  // The weights of the values in a step, from the polynomials and the moments.
  void weigh_values(Lanes changed, int c) {
    auto keep = [&](Real *at, Lanes x) {
      put(at, c, choose_less(Lanes(0.5), changed, x, get(at, c)));
    };
    Lanes a[POWERS], b[POWERS];
    for (int m = 0; m < POWERS; ++m) a[m] = get(A + m * stride, c), b[m] = get(B + m * stride, c);
    auto set_weights = [&](int column, Real *place, Real *rate) {
      Lanes p = 0.0, q = 0.0;
      for (int m = 0; m <= ORDER; ++m)
        p += wide(poly[m][column]) * a[m], q += wide(poly[m][column]) * b[m];
      keep(place, p), keep(rate, q);
    };
    for (int j = 0; j < ORDER; ++j)
      set_weights(j, predictor_weights[0][j], predictor_weights[1][j]);
    set_weights(GAP, corrector_weights[0], corrector_weights[1]),
        set_weights(OLDEST, corrector_weights[2], corrector_weights[3]);
  }
};

}  // namespace flexura
