// The rig: states, commands, and what happens in a control tick. The same code runs on the board, in its emulator and in host tests.
#pragma once
#include "declaration.h"
#include "filter.h"
#include "pid.h"
#include "player.h"
#include "scales.h"
#include "steps.h"
#include "tip.h"
#include "watch.h"

namespace flexura {

// While one exists the control interrupt waits. Defined by whoever has interrupts: src/ on the board, nothing on the host.
class Section {
 public:
  Section();
  ~Section();
  Section(const Section &) = delete;
  Section &operator=(const Section &) = delete;

 private:
  uint8_t before_;
};

// What the control interrupt does to the hardware.
struct Outputs {
  bool on = false;                       // motor bridge and stepper driver enabled
  int16_t duty = 0;                      // PWM counts, + up
  StepPlan steps;                        // for the tick that comes next
};

class Rig {
 public:
  // `stored` is what the memory holds, or nothing where its check failed. `reset`: bits of Reset.
  void begin(const Config *stored, uint8_t reset);

  // Control interrupt: fill the inputs, then tick.
  Inputs &inputs() { return in_; }
  void tick(Outputs &out);
  // Into Fault, unless there already: the first reason stays. From interrupts or inside a Section.
  void trip(Fault fault);

  // Main loop. `detail` belongs to the result. config_read, config_save and hello are the link's business (link.h).
  Result command(uint8_t code, const uint8_t *fields, uint16_t &detail);
  void report(Telemetry &report) const;
  void host_spoke();
  void prepare() { player_.prepare(); }  // often
  bool may_configure() const;
  uint8_t wrong_item() const { return wrong_item_; }   // why the configuration in use cannot be stored, or kConsistent
  void stored() { stored_ = true; }      // it is the stored one now

  State state() const { return state_; }
  bool active() const { return state_ == State::armed || state_ == State::running; }
  Fault fault() const { return fault_; }
  uint32_t now() const;
  const Config &config() const { return config_; }
  const Scales &scales() const { return scales_; }

 private:
  void sense();
  int32_t error(uint8_t joint) const;    // counts / 256 or microsteps / 256
  void control();
  Result reference(const Reference &command);
  Result arm(uint8_t mode, uint16_t &detail);
  Result start(uint8_t period_log2, uint16_t &detail);
  Result clear(uint8_t fault, uint16_t &detail);
  Result add_setpoints(const Setpoints &command, uint16_t &detail);
  Result add_drives(const Drives &command, uint16_t &detail);
  Result may_add(uint16_t first, uint8_t count, uint8_t most, uint16_t &detail) const;
  bool inside(const Knot &knot) const;
  Result configure(uint8_t item, float value, uint16_t &detail);
  void rescale();

  // What every tick touches comes first, within reach of one address register.
  volatile State state_ = State::idle;
  volatile Fault fault_ = Fault::none;
  Mode mode_ = Mode::position;
  bool final_ = false;
  volatile uint32_t tick_ = 0;
  Inputs in_ = {};
  Watched seen_ = {};
  int32_t steps_given_ = 0;              // pulses
  int32_t by_encoder_ = 0;               // joint 2 by its encoder, whole microsteps, and the rest of it as Q16
  uint16_t by_encoder_rest_ = 0;
  uint16_t missed_ = 0;
  Velocity velocity_[2];
  Tick target_ = {{0, 0}};               // of this tick
  int16_t setpoint_rate_[2] = {0, 0};    // counts / 256 per tick
  uint16_t flex_before_ = 0;             // reading of the tick before
  Pid pid_[2];
  Steps steps_;
  Tip tip_;
  int32_t tip_term_[2] = {0, 0};         // pid.h
  Watch watch_;
  Scales scales_;
  Player player_;

  uint32_t fault_tick_ = 0;
  bool referenced_ = false, stored_ = false;
  uint8_t wrong_item_ = kConsistent;     // of the configuration in use
  Config config_;
};

}  // namespace flexura
