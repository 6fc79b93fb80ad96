// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The rig: states, commands, and what happens in a control tick. The same code runs on the board,
// in its emulator and in host tests.
#pragma once
#include "declaration.h"
#include "disturbance_observer.h"
#include "fault_monitor.h"
#include "filter.h"
#include "fixed_point_config.h"
#include "flex_sensor.h"
#include "pid.h"
#include "step_generator.h"
#include "trajectory_player.h"

namespace flexura {

// While one exists the control interrupt waits. src/ defines it on the board; on the host it does
// nothing.
class CriticalSection {
 public:
  CriticalSection();
  ~CriticalSection();
  CriticalSection(const CriticalSection &) = delete;
  CriticalSection &operator=(const CriticalSection &) = delete;

 private:
  uint8_t before_;
};

// While one exists all interrupts wait, the watchdog's too. For a few cycles only.
class InterruptLock {
 public:
  InterruptLock();
  ~InterruptLock();
  InterruptLock(const InterruptLock &) = delete;
  InterruptLock &operator=(const InterruptLock &) = delete;

 private:
  uint8_t before_;
};

// What the control interrupt does to the hardware.
struct Outputs {
  bool on = false;           // the drives that the rig has are enabled
  int16_t duty[2] = {0, 0};  // PWM counts, + up
  StepPlan steps;            // for the tick that comes next
};

class Rig {
 public:
  // `stored` is what the memory holds, or nothing where its check failed. `reset`: bits of Reset.
  // `motors`: how many bridges the pins have.
  void begin(const Stored *stored, uint8_t reset, uint32_t firmware, uint8_t motors = 2);

  // Control interrupt: fill the inputs, then tick.
  Inputs &inputs() { return in_; }
  void tick(Outputs &out);
  // Into Fault, unless there already: the first reason stays. From interrupts or inside a
  // CriticalSection.
  void trip(Fault fault);

  // Main loop. Obeys a command by its code; `detail` belongs to the result. Commands of the session
  // (session.h) are unknown here.
  Result command(uint8_t code, const uint8_t *fields, uint16_t &detail);
  void report(Telemetry &report) const;
  void host_spoke();
  void prepare() { player_.prepare(); }  // often
  bool may_configure() const;
  // Number of the setting that forbids storing the settings in use, or kAllValid.
  uint8_t wrong_item() const { return wrong_item_; }
  void stored() { stored_ = true; }  // the settings in use are the stored ones now

  State state() const { return state_; }
  Drive drive(uint8_t joint) const { return fixed_.limits.drive[joint]; }
  bool active() const { return state_ == State::armed || state_ == State::running; }
  Fault fault() const { return fault_; }
  uint32_t now() const;
  const Config &config() const { return config_; }
  uint32_t firmware() const { return firmware_; }  // its hash
  uint32_t proven() const { return proven_; }      // Stored
  StopTrial stop_trial() const { return stop_trial_; }
  const FixedPointConfig &fixed() const { return fixed_; }

 private:
  void sense();
  void replace_encoder_2();
  void watch_stop();
  int32_t error(uint8_t joint) const;  // counts / 256 or microsteps / 256
  int32_t open_loop(uint8_t joint) const;
  void control();

  // One handler a command, called through the table in commands.cpp.
  template <class Message>
  static Result handle_fields(Rig &rig, const uint8_t *fields, uint16_t &detail);
#define FLEXURA_HANDLER(Message) Result handle(const Message &command, uint16_t &detail);
  FLEXURA_RIG_COMMANDS(FLEXURA_HANDLER)
#undef FLEXURA_HANDLER
  struct Handler;
  static const Handler kHandlers[];

  bool enter(State from, State to);  // false if the state is another one by now
  Result may_add(uint16_t first, uint8_t count, uint8_t most, uint16_t &detail) const;
  uint8_t convert(FixedPointConfig &fixed) const;
  void update_fixed_point();

  // What every tick touches comes first, within reach of one address register.
  volatile State state_ = State::idle;
  volatile Fault fault_ = Fault::none;
  Mode mode_ = Mode::position;
  bool final_ = false;
  volatile uint32_t tick_ = 0;
  Inputs in_ = {};
  Measured measured_ = {};
  int32_t steps_given_ = 0;  // pulses
  int32_t by_encoder_ = 0;   // joint 2 by its encoder, whole microsteps, and the rest of it as Q16
  uint16_t by_encoder_rest_ = 0;
  uint16_t missed_ = 0;
  Velocity velocity_[2];
  Tick target_ = {{0, 0}};             // of this tick
  int16_t setpoint_rate_[2] = {0, 0};  // counts / 256 per tick
  uint16_t flex_before_ = 0;           // reading of the tick before
  Pid pid_[2];
  DisturbanceObserver observer_[2];
  StepGenerator step_generator_;
  FlexSensor flex_sensor_;
  int32_t added_[2] = {0, 0};        // pid.h
  int32_t disturbance_[2] = {0, 0};  // disturbance_observer.h, Q16 of u
  FaultMonitor monitor_;
  FixedPointConfig fixed_;
  TrajectoryPlayer player_;

  uint32_t fault_tick_ = 0;
  volatile bool referenced_ = false;
  volatile StopTrial stop_trial_ = StopTrial::untried;
  uint8_t stop_open_ = 0;  // ticks
  uint32_t firmware_ = 0;
  uint32_t proven_ = 0;
  uint8_t motors_ = 2;
  bool stored_ = false;
  uint8_t wrong_item_ = kAllValid;  // of the settings in use
  Config config_;
};

}  // namespace flexura
