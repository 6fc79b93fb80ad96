// What happens in a control tick: sense, watch, play, control.
#include "rig.h"

namespace flexura {

namespace {
constexpr int32_t kRateOfStep = 536871;   // Q29 microsteps per tick in 1 microstep/s

bool is_set(uint8_t bits, Reset cause) { return bits >> static_cast<uint8_t>(cause) & 1; }
}  // namespace

void Rig::begin(const Config *stored, uint8_t reset) {
  config_ = stored ? *stored : default_config();
  wrong_item_ = make_scales(config_, scales_);
  stored_ = stored && wrong_item_ == kConsistent;
  if (!stored_) {
    config_ = default_config();
    wrong_item_ = make_scales(config_, scales_);
  }
  if (is_set(reset, Reset::watchdog)) trip(Fault::watchdog);
  if (is_set(reset, Reset::brown_out) && !is_set(reset, Reset::power_on)) trip(Fault::brown_out);
  if (!stored_) trip(Fault::bad_configuration);
}

void Rig::trip(Fault fault) {
  if (state_ == State::fault) return;
  fault_ = fault;
  fault_tick_ = tick_;
  state_ = State::fault;
}

void Rig::sense(const Inputs &in) {
  in_ = in;
  for (uint8_t j = 0; j < 2; ++j) {
    joint_[j].position += in.moved[j];
    joint_[j].velocity.update(in.moved[j], scales_.velocity_filter);
    missed_ = static_cast<uint16_t>(missed_ + in.missed[j]);
  }
  steps_given_ += in.stepped;
  const int32_t rest = by_encoder_rest_ + scales_.ratio * in.moved[1];
  by_encoder_ += rest >> 16;
  by_encoder_rest_ = static_cast<uint16_t>(rest);
  tip_.update(scales_.tip, in.flex);
}

int32_t Rig::error(uint8_t joint) const {
  if (joint == 0) return subtract(joint_[0].setpoint.position(), q8(joint_[0].position));
  const int32_t position = scales_.on_encoder ? q8(by_encoder_) + (by_encoder_rest_ >> 8) : steps_.position();
  return subtract(joint_[1].setpoint.position(), position);
}

void Rig::tick(const Inputs &in, Outputs &out) {
  tick_ = tick_ + 1;
  sense(in);

  int32_t errors[2] = {0, 0};
  const bool tracking = state_ == State::running && mode_ == Mode::position;
  if (state_ == State::running) {
    const Player::Event event = player_.advance();
    if (event == Player::Event::underrun) trip(Fault::underrun);
    final_ = event == Player::Event::final;
  }
  if (tracking) {
    for (uint8_t j = 0; j < 2; ++j) {
      joint_[j].setpoint.update(player_.position()[j], player_.velocity()[j], scales_.setpoint_filter[j]);
      errors[j] = error(j);
    }
  }
  if (state_ == State::armed || state_ == State::running) {
    const Watched seen = {{joint_[0].position, joint_[1].position},
                          {joint_[0].velocity.value(), joint_[1].velocity.value()},
                          voltage_,
                          subtract(q8(by_encoder_) + (by_encoder_rest_ >> 8), q8(steps_given_)),
                          tracking,
                          {errors[0], errors[1]}};
    const Fault fault = watch_.check(scales_.limits, in, seen);
    if (fault != Fault::none) trip(fault);
  }

  out.steps.count = 0;
  if (state_ != State::armed && state_ != State::running) {
    out.bridge = out.driver = false;
    out.duty = 0;
    out.pair[0] = out.pair[1] = true;
    voltage_ = 0;
    saturated_ = false;
    return;
  }
  control(errors, out);
}

void Rig::control(const int32_t *errors, Outputs &out) {
  Pid &motor = joint_[0].pid, &stepper = joint_[1].pid;
  const PidGains *gains = scales_.gains;
  if (state_ == State::armed) {
    motor.start(0);
    stepper.follow(gains[1], 0);
  } else if (mode_ == Mode::open_loop) {
    motor.follow(gains[0], static_cast<int32_t>(player_.velocity()[0]) * 65536);
    stepper.follow(gains[1], multiply(kRateOfStep, player_.velocity()[1]));
  } else {
    PidSignals signals = {errors[0], joint_[0].velocity.value(), joint_[0].setpoint.rate(), tip_.deflection(), tip_.rate()};
    motor.update(gains[0], signals);
    signals.error = errors[1];
    signals.setpoint_rate = joint_[1].setpoint.rate();
    signals.rate = scales_.on_encoder ? narrow(multiply(scales_.ratio, joint_[1].velocity.value()) >> 16)
                                      : static_cast<int16_t>(stepper.output() >> 21);
    stepper.update(gains[1], signals);
  }
  const int32_t u = motor.output();
  saturated_ = u >= gains[0].limit || u <= -gains[0].limit;
  voltage_ = static_cast<int16_t>(u >> 16);
  out.bridge = out.driver = true;
  out.duty = clamp<int16_t>(static_cast<int16_t>(multiply(scales_.duty, voltage_) >> 16), -kDutyFull, kDutyFull);
  steps_.plan(stepper.output(), out.steps);
  out.pair[0] = voltage_ <= scales_.limits.stall_voltage && voltage_ >= -scales_.limits.stall_voltage;
  out.pair[1] = stepper.output() == 0;
}

uint32_t Rig::now() const {
  Section section;
  return tick_;
}

void Rig::report(Telemetry &report) const {
  Section section;
  report.tick = tick_;
  report.state = static_cast<uint8_t>(state_);
  report.fault = static_cast<uint8_t>(fault_);
  report.fault_tick = fault_tick_;
  report.flags = static_cast<uint8_t>(in_.switches | referenced_ << static_cast<uint8_t>(Flag::referenced) |
                                      final_ << static_cast<uint8_t>(Flag::final) |
                                      saturated_ << static_cast<uint8_t>(Flag::saturated));
  if (state_ == State::armed || state_ == State::running)
    report.flags |= 1 << static_cast<uint8_t>(Flag::bridge_enabled) | 1 << static_cast<uint8_t>(Flag::driver_enabled);
  report.buffered = player_.waiting();
  report.position_1 = joint_[0].position;
  report.position_2 = joint_[1].position;
  report.steps = steps_given_;
  report.setpoint_1 = joint_[0].setpoint.position();
  report.setpoint_2 = joint_[1].setpoint.position();
  report.voltage = voltage_;
  report.rate = static_cast<int16_t>((joint_[1].pid.output() >> 13) * 1000 >> 16);
  report.flex = in_.flex;
  report.supply = static_cast<uint16_t>(static_cast<uint32_t>(in_.supply) * scales_.supply >> 6);
  report.missed = missed_;
}

void Rig::host_spoke() {
  Section section;
  watch_.host_spoke();
}

}  // namespace flexura
