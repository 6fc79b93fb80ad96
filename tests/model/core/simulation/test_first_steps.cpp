// What "auto" decides without a comparison of methods.
#include "simulation/first_steps.hpp"

#include <string>

#include "check.hpp"
#include "plants.hpp"
#include "sprung.hpp"

using namespace flexura;

TEST("what needs no trial: rigid robots, sharp tolerances, strong dampers") {
  struct {
    double kp, kd;
    bool prescribed, moves;
    const char *name;
  } rigid[] = {{0.0, 0.0, false, true, "explicit"},
               {0.0, 0.0, true, true, "explicit"},
               {5.0, 1.0, false, false, "explicit"},
               {0.0, 1.0, false, true, nullptr},
               {5.0, 0.0, false, true, nullptr}};
  for (const auto &each : rigid) {
    Masses<double> plant(1);
    Inputs acting(1);
    JointDrive &drive = acting.joints[0];
    drive.kp = each.kp, drive.kd = each.kd, drive.prescribed = each.prescribed;
    if (each.moves) drive.motion = {constant(0.0, 0.1)};
    Inputs *all[1] = {&acting};
    Integration<double> run(plant, all, 1e-4);
    const char *name = method_without_trial(run, 0.0, 1e-4);
    CHECK((name ? std::string(name) : "") == (each.name ? each.name : ""));
  }
  struct {
    double stiffness, damper, rtol;
    const char *name;
  } bends[] = {{100.0, 0.0, 1e-10, "explicit"},
               {1e14, 0.0, 1e-10, nullptr},
               {1e14, 2e3, 1e-10, nullptr},
               {100.0, 2e3, 1e-4, "implicit"},
               {100.0, 0.0, 1e-4, nullptr}};
  for (const auto &each : bends) {
    Masses<double> plant = sprung(each.stiffness, each.damper);
    Inputs acting(1);
    Inputs *all[1] = {&acting};
    Integration<double> run(plant, all, each.rtol);
    const char *name = method_without_trial(run, 0.0, each.rtol);
    CHECK((name ? std::string(name) : "") == (each.name ? each.name : ""));
  }
}

TEST("first exponential steps: a run that is over is settled, one that got stuck is not") {
  struct {
    Status status;
    double speed;
    bool settled;
  } cases[] = {{Status::done, 0.05, true},        {Status::limit, 0.05, true},
               {Status::interrupted, 0.05, true}, {Status::exhausted, 0.05, false},
               {Status::stuck, -1.0, false},      {Status::diverged, -1.0, false},
               {Status::running, 0.05, true}};
  for (const auto &each : cases) {
    FirstSteps pace;
    RunState run;
    pace.half = 1.0, run.t = 3.0, run.end = 5.0, run.status = each.status;
    CHECK(pace.speed(run) == each.speed && pace.settled(run) == each.settled);
    run.end = 100.0;
    CHECK(pace.settled(run) == (each.settled && each.status != Status::running));
  }
}
