#include "simulation/copies.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

#include "control/model_plant.hpp"
#include "dynamics/places/outputs.hpp"
#include "integration/runge_kutta/rosenbrock.hpp"
#include "link/assembly.hpp"

namespace flexura {
namespace {

using Four = Pack<4>;
constexpr int LANES = 4;
constexpr int PORTION = 16;  // packs that a thread takes at a time

Model<Four> four_of(const Model<double> &robot) {
  const Model<double> *const same[LANES] = {&robot, &robot, &robot, &robot};
  return pack(same);
}

}  // namespace

// What one thread moves packs with.
class Copies::Worker {
 public:
  Worker(const Copies &copies, const States &states, double step_s, int steps)
      : all_(copies),
        states_(states),
        step_s_(step_s),
        steps_(steps),
        n_(copies.unknowns()),
        joints_(copies.joints()),
        work_(copies.four_),
        plant_(copies.four_, work_),
        inputs_(LANES, Inputs(copies.joints())),
        acts_(plant_, pointers()),
        method_(plant_, acts_),
        q_(std::size_t(padded(n_)), Four(0.0)),
        v_(q_),
        poses_(std::size_t(joints_) + 1) {
    for (int i = 0; i < joints_; ++i) inputs_[0].limit(i, states.low[i], states.high[i]);
  }

  // Copies `first` to `first + 3`, as far as there are so many.
  void move(int first) {
    const int here = std::min(LANES, states_.count - first);
    bool good[LANES];
    for (int k = 0; k < LANES; ++k) {
      const int copy = first + (k < here ? k : 0);  // lanes without a copy have the first again
      good[k] = k < here && states_.moves[copy];
      for (int i = 0; i < n_; ++i)
        q_[std::size_t(i)].set(k, row(states_.q, copy, n_)[i]),
            v_[std::size_t(i)].set(k, row(states_.v, copy, n_)[i]);
      std::copy_n(row(states_.force, copy, joints_), joints_,
                  inputs_[std::size_t(k)].held.force.begin());
    }
    acts_.at(Four(0.0));
    for (int step = 0; step < steps_; ++step) {
      method_.step(q_.data(), v_.data(), Four(step_s_));
      for (int k = 0; k < here; ++k) good[k] = good[k] && inside(k);
    }
    for (int k = 0; k < here; ++k) {
      states_.arrived[first + k] = good[k];
      for (int i = 0; i < n_ && good[k]; ++i)
        row(states_.q, first + k, n_)[i] = q_[std::size_t(i)][k],
                                  row(states_.v, first + k, n_)[i] = v_[std::size_t(i)][k];
    }
    look(first, here, good);
  }

 private:
  const Copies &all_;
  const States &states_;
  const double step_s_;
  const int steps_, n_, joints_;
  Workspace<Four> work_;
  ModelPlant<Four> plant_;
  std::vector<Inputs> inputs_;
  Inputs *pointers_[LANES];
  DriveForces<Four> acts_;
  Rosenbrock<Four> method_;
  std::vector<Four> q_, v_;
  std::vector<Pose<Four>> poses_;

  Inputs *const *pointers() {
    for (std::size_t k = 0; k < LANES; ++k) pointers_[k] = &inputs_[k];
    return pointers_;
  }

  template <class Number>
  static Number *row(Number *of, int copy, int wide) {
    return of + std::ptrdiff_t(copy) * wide;
  }

  // Is the state in lane k a number, and every joint within its limits?
  bool inside(int k) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < std::size_t(n_); ++i) sum += q_[i][k] + v_[i][k];
    bool out = std::isfinite(sum);
    for (std::size_t i = 0; i < std::size_t(joints_); ++i) {
      const double place = q_[std::size_t(plant_.first[i])][k];
      out = out && inputs_[0].low[i] <= place && place <= inputs_[0].high[i];
    }
    return out;
  }

  // Where the tips are, of the lanes that are good.
  void look(int first, int here, const bool *good) {
    const int bending = int(all_.bending_.size());
    Four speed[2];
    outward_kinematics(all_.four_, work_, q_.data(), v_.data());
    hub_poses(all_.four_, work_, q_.data(), v_.data(), poses_.data(), speed);
    for (int k = 0; k < here; ++k)
      if (good[k])
        row(states_.tip, first + k, 2)[0] = poses_.back().x[k],
                                    row(states_.tip, first + k, 2)[1] = poses_.back().y[k];
    for (int i = 0; i < bending; ++i) {
      const BendOf<Four> tip = bend(all_.four_, work_, q_.data(), all_.bending_[std::size_t(i)]);
      for (int k = 0; k < here; ++k)
        if (good[k]) row(states_.deflection, first + k, bending)[i] = tip.deflection[k];
    }
  }
};

Copies::Copies(std::shared_ptr<const Model<double>> robot)
    : single_(std::move(robot)), four_(four_of(*single_)) {
  for (int i = 0; i < joints(); ++i)
    if (single_->bends(i)) bending_.push_back(i);
}

void Copies::advance(const States &states, double step_s, int steps, int threads) const {
  constexpr int EACH = PORTION * LANES;
  std::atomic<int> next{0};
  std::mutex lock;
  std::exception_ptr failure;
  auto work = [&] {
    try {
      Worker worker(*this, states, step_s, steps);
      for (int first; (first = next.fetch_add(EACH)) < states.count;)
        for (int at = first; at < std::min(first + EACH, states.count); at += LANES)
          worker.move(at);
    } catch (...) {
      const std::lock_guard<std::mutex> guard(lock);
      failure = std::current_exception(), next = states.count;
    }
  };
  std::vector<std::thread> others;
  for (int k = 1; k < std::min(threads, (states.count + EACH - 1) / EACH); ++k)
    others.emplace_back(work);
  work();
  for (std::thread &other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flexura
