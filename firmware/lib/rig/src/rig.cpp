// What happens in a control tick: sense, watch, play, control.
#include "rig.h"

namespace flexura {

namespace {
constexpr int32_t kRateOfStep = 268435;    // Q16, units of u_2 (1/4096 microstep per tick) in 1 microstep/s

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

void Rig::sense() {
  for (uint8_t j = 0; j < 2; ++j) {
    seen_.position[j] += in_.moved[j];
    if (j == 0 || scales_.on_encoder) {                  // else nobody asks
      velocity_[j].update(in_.moved[j], scales_.velocity_filter);
      seen_.velocity[j] = velocity_[j].value();
    }
    if (in_.missed[j]) missed_ = static_cast<uint16_t>(missed_ + in_.missed[j]);
  }
  steps_given_ += in_.stepped;
  const int32_t rest = by_encoder_rest_ + scales_.ratio * in_.moved[1];
  by_encoder_ += upper(rest);
  by_encoder_rest_ = lower(rest);
  seen_.lag = q8(by_encoder_ - steps_given_) + (by_encoder_rest_ >> 8);
  // The strip's slowness allows two ticks a reading, and noise asks for them.
  if (tick_ & 1) {
    flex_before_ = in_.flex;
  } else {
    tip_.update(scales_.tip, static_cast<uint16_t>(flex_before_ + in_.flex));
  }
}

// Set-points and positions lie within half of what 32 bits hold (scales.cpp, commands.cpp), so that their differences fit.
int32_t Rig::error(uint8_t joint) const {
  const int32_t position = joint == 0         ? q8(seen_.position[0])
                           : scales_.on_encoder ? q8(by_encoder_) + (by_encoder_rest_ >> 8)
                                              : steps_.position();
  return static_cast<int32_t>(static_cast<uint32_t>(target_.of[joint]) - static_cast<uint32_t>(position));
}

void Rig::tick(Outputs &out) {
  tick_ = tick_ + 1;
  sense();
  out.steps.count = 0;
  seen_.tracking = false;
  if (state_ == State::running) {
    const Tick before = target_;
    const Player::Event event = player_.advance(target_);
    if (event == Player::Event::underrun) trip(Fault::underrun);
    final_ = event == Player::Event::final;
    if (mode_ == Mode::position) {
      seen_.tracking = true;
      for (uint8_t j = 0; j < 2; ++j) {
        setpoint_rate_[j] = narrow(target_.of[j] - before.of[j]);
        seen_.error[j] = error(j);
      }
    }
  }
  if (active()) {
    const Fault fault = watch_.check(scales_.limits, in_, seen_);
    if (fault != Fault::none) trip(fault);
  }
  if (active()) {
    control();
    out.on = true;
    out.duty = seen_.duty;
    steps_.plan(pid_[1].output(), out.steps);
  } else {
    out.on = false;
    out.duty = seen_.duty = 0;
  }
}

void Rig::control() {
  const PidGains *gains = scales_.gains;
  if (state_ == State::armed) {
    pid_[0].start(0);
    pid_[1].follow(gains[1], 0);
  } else if (mode_ == Mode::open_loop) {
    pid_[0].follow(gains[0], upper(multiply(scales_.duty, static_cast<int16_t>(target_.of[0]))));
    pid_[1].follow(gains[1], part(kRateOfStep, static_cast<int16_t>(target_.of[1])));
  } else {
    // The deflection is new in every second tick; one joint takes it at once, the other in the next.
    const uint8_t turn = tick_ & 1;
    tip_term_[turn] = tip_term(gains[turn], tip_.deflection(), tip_.rate());
    PidSignals signals = {seen_.error[0], seen_.velocity[0], setpoint_rate_[0], tip_term_[0]};
    pid_[0].update(gains[0], signals);
    signals.error = seen_.error[1];
    signals.tip = tip_term_[1];
    signals.setpoint_rate = setpoint_rate_[1];
    signals.rate = scales_.on_encoder ? upper(multiply(scales_.ratio, seen_.velocity[1])) : static_cast<int16_t>(pid_[1].output() >> 4);
    pid_[1].update(gains[1], signals);
  }
  seen_.duty = static_cast<int16_t>((pid_[0].output() + 8) >> 4);
}

uint32_t Rig::now() const {
  Section section;
  return tick_;
}

void Rig::report(Telemetry &report) const {
  int16_t duty, rate;
  bool on;
  {
    Section section;                                 // copies only: the control interrupt waits
    report.tick = tick_;
    report.state = static_cast<uint8_t>(state_);
    report.fault = static_cast<uint8_t>(fault_);
    report.fault_tick = fault_tick_;
    report.flags = in_.switches;
    report.position_1 = seen_.position[0];
    report.position_2 = seen_.position[1];
    report.steps = steps_given_;
    report.setpoint_1 = target_.of[0];
    report.setpoint_2 = target_.of[1];
    report.flex = in_.flex;
    report.supply = in_.supply;
    report.missed = missed_;
    on = active();
    duty = pid_[0].output();
    rate = pid_[1].output();
  }
  const bool saturated = on && (duty >= scales_.gains[0].limit || duty <= -scales_.gains[0].limit);
  const bool bits[] = {on, on, referenced_, final_, saturated};   // from bridge_enabled on, in the order of Flag
  for (uint8_t k = 0; k < sizeof bits; ++k)
    if (bits[k]) report.flags = static_cast<uint8_t>(report.flags | 1 << (static_cast<uint8_t>(Flag::bridge_enabled) + k));
  report.buffered = player_.waiting();
  report.voltage = on ? upper(multiply(scales_.voltage, duty)) : 0;
  report.rate = on ? static_cast<int16_t>(rate * 1000L / 4096) : 0;
  report.supply = static_cast<uint16_t>(static_cast<uint32_t>(report.supply) * scales_.supply >> 6);
}

void Rig::host_spoke() {
  Section section;
  watch_.host_spoke();
}

}  // namespace flexura
