// Many robots of one topology, from rows of numbers to rows of channels: worker threads that take
// four robots at a time.
//
// Four robots are assembled together, put into packs, run, and observed; of one that differs in its
// kind of equations (another number of shapes, prescribed joints) a pack is made of its own. A
// robot with loads on its links runs alone. A robot's digits depend on nothing but itself.
#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "integration/run_state.hpp"
#include "robot/robot_table.hpp"

namespace flexura {

// What is kept of a run: of joint `index` position, velocity or drive; account `index`; column
// `index` of an Observer.
struct Channel {
  enum Of { position, velocity, drive, account, seen, motor_position, motor_velocity } of;
  int index;
};

struct Population {
  Table robots;
  const double *limits = nullptr;  // (robots, links, 2), the ends of links that slide included
  std::vector<Inputs> drives;      // and loads on links, limits apart; no functions nor samplers
  std::vector<int> drive_of;       // (robots): index of the drive
  std::vector<double> times;       // of the outputs; the first is the start
  std::vector<double> q;  // (n) at the start, the same for all, or (robots, n); empty: each
                          // robot's own start, links straight
  std::vector<double> v;  // (n), the same for all; empty: at rest
  double rtol = 1e-6;
  std::string method = "auto";
  bool numerical_damping = true;
  long most_steps = 0;  // of a robot; 0: no budget
  std::vector<Channel> channels;
  int stations = 21;  // of an Observer
};

// How one robot ended.
struct Ending {
  enum Refusal {
    none,
    fault,
    start
  } refusal = none;  // start: a joint starts outside its own limits
  Status status = Status::running;
  double reached = 0.0;  // [s]
  int joint = -1;  // that met its limit, starts outside of it, or where the run got stuck; of a
                   // fault: the link
  long steps = 0;
  double balance = 0.0;          // of a robot that is done: see Worker::balance
  std::vector<double> position;  // (links) of the joints at the end
  std::string key, text;  // of a fault the key and what was expected; else why the run ended early
};

// Runs all robots in so many threads. values (channels, robots, times): NaN from where a robot
// stopped. `stop` ends it early: endings that are not reached then have the status running or
// interrupted. `done` counts robots.
std::vector<Ending> run(const Population &population, int threads, double *values,
                        const std::atomic<bool> &stop, std::atomic<long> &done);

}  // namespace flexura
