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
  bool bridge = false, driver = false;   // enables
  int16_t duty = 0;                      // PWM counts, + up
  StepPlan steps;                        // for the tick that comes next
  bool pair[2] = {false, false};         // an encoder's count of one-sided edges starts again: nothing drives that joint
};

class Rig {
 public:
  // `stored` is what the memory holds, or nothing where its check failed. `reset`: bits of Reset.
  void begin(const Config *stored, uint8_t reset);

  // Control interrupt.
  void tick(const Inputs &in, Outputs &out);
  // Into Fault, unless there already: the first reason stays. From interrupts or inside a Section.
  void trip(Fault fault);

  // Main loop. `detail` belongs to the result. config_read, config_save and hello are the link's business (link.h).
  Result command(uint8_t code, const uint8_t *fields, uint16_t &detail);
  void report(Telemetry &report) const;
  void host_spoke();
  bool may_configure() const;
  uint8_t wrong_item() const { return wrong_item_; }   // why the configuration in use cannot be stored, or kConsistent
  void stored() { stored_ = true; }      // it is the stored one now

  State state() const { return state_; }
  Fault fault() const { return fault_; }
  uint32_t now() const;
  const Config &config() const { return config_; }
  const Scales &scales() const { return scales_; }

 private:
  struct Joint {
    int32_t position = 0;                // counts of its encoder
    Velocity velocity;
    Setpoint setpoint;
    Pid pid;
  };

  void sense(const Inputs &in);
  int32_t error(uint8_t joint) const;    // counts / 256 or microsteps / 256
  void control(const int32_t *errors, Outputs &out);
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

  volatile State state_ = State::idle;
  volatile Fault fault_ = Fault::none;
  Mode mode_ = Mode::position;
  volatile uint32_t tick_ = 0;
  uint32_t fault_tick_ = 0;
  bool referenced_ = false, stored_ = false, final_ = false, saturated_ = false;
  uint8_t wrong_item_ = kConsistent;     // of the configuration in use
  Config config_;
  Scales scales_;
  Joint joint_[2];
  int32_t steps_given_ = 0;              // pulses
  int32_t by_encoder_ = 0;               // joint 2 by its encoder, whole microsteps, and the rest of it as Q16
  uint16_t by_encoder_rest_ = 0;
  Steps steps_;
  Tip tip_;
  Player player_;
  Watch watch_;
  int16_t voltage_ = 0;                  // mV
  uint16_t missed_ = 0;
  Inputs in_ = {};
};

}  // namespace flexura
