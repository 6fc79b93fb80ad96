// A linear law with an observer, discrete in time (flexura/lqr.py makes its matrices):
//
//   z^ = z + L (y - C z),   u = hold - K z^ + Kr r + Kv r',   z of the next tick = F z^ + G (u as given - hold)
//
// y: what is measured, positions of the joints and the deflection of the last flexible link's tip, less `offset`, their values where
// the robot was linearised.
#pragma once
#include <vector>

namespace flexura {

struct LinearLaw {
  int states = 0, joints = 0, measured = 0;  // no states: there is no such law
  std::vector<double> F, G, L, C, K, Kr, Kv; // (p, p), (p, N), (p, M), (M, p), (N, p), (N, N), (N, N)
  std::vector<double> offset, hold;          // (M), (N)
  std::vector<double> predicted, estimated;  // z, z^ (p)
  std::vector<double> y;                     // (M)

  bool present() const { return states > 0; }

  void start() {
    predicted.assign(std::size_t(states), 0.0), estimated = predicted;
    y.assign(std::size_t(measured), 0.0);
  }

  void measure(int k, double value) { y[std::size_t(k)] = value - offset[std::size_t(k)]; }

  void estimate() {
    estimated = predicted;
    for (int b = 0; b < measured; ++b) {
      double news = y[std::size_t(b)];
      for (int a = 0; a < states; ++a) news -= C[std::size_t(b * states + a)] * predicted[std::size_t(a)];
      for (int a = 0; a < states; ++a) estimated[std::size_t(a)] += L[std::size_t(a * measured + b)] * news;
    }
  }

  // What joint i's u comes to from the estimate, without references.
  double wish(int i) const {
    double u = hold[std::size_t(i)];
    for (int a = 0; a < states; ++a) u -= K[std::size_t(i * states + a)] * estimated[std::size_t(a)];
    return u;
  }
  // What the reference of joint j and its rate add to joint i's u.
  double follow(int i, int j, double reference, double rate) const {
    const std::size_t at = std::size_t(i * joints + j);
    return Kr[at] * (reference - offset[std::size_t(j)]) + Kv[at] * rate;
  }

  // `given` (N): outputs.
  void predict(const std::vector<double> &given) {
    for (int a = 0; a < states; ++a) {
      double sum = 0.0;
      for (int b = 0; b < states; ++b) sum += F[std::size_t(a * states + b)] * estimated[std::size_t(b)];
      for (int i = 0; i < joints; ++i) sum += G[std::size_t(a * joints + i)] * (given[std::size_t(i)] - hold[std::size_t(i)]);
      predicted[std::size_t(a)] = sum;
    }
  }
};

}  // namespace flexura
