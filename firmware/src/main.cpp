// Arduino Mega 2560: the control interrupt, the main loop, the watchdog. What can be tested elsewhere is in lib/.
#include <Arduino.h>
#include <avr/wdt.h>

#include "link.h"
#include "motor.h"
#include "pins.h"
#include "sensors.h"
#include "stepper.h"
#include "store.h"
#include "uart.h"

using flexura::Fault;
using flexura::State;

namespace {

flexura::Rig rig;
flexura::Build build = {{0, 1, 0}, {__GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__}, 0};
flexura::Link link(rig, build);

flexura::Outputs outputs;
volatile bool in_tick;
volatile uint16_t longest;             // control interrupt, in counts of timer 5 from when it was due

// The watchdog's first bite writes this; SRAM outlives the reset that follows, MCUSR may not outlive the boot loader.
struct Marker {
  uint16_t magic;
  uint8_t bites, complement;
};
Marker marker __attribute__((section(".noinit")));
uint8_t reset_cause __attribute__((section(".noinit")));
constexpr uint16_t kMagic = 0xB17E;

void outputs_off() {
  motor::drive(0);
  motor::enable(false);
  stepper::stop();
  stepper::enable(false);
}

void watchdog_on() {
  const uint8_t flags = SREG;
  cli();
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDIE) | _BV(WDE) | _BV(WDP1);   // 64 ms: interrupt, and as long again to the reset
  SREG = flags;
}

}  // namespace

// First of all after a reset: a watchdog that has bitten is still running, at its shortest.
void save_reset_cause() __attribute__((naked, used, section(".init3")));
void save_reset_cause() {
  reset_cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

// Only the control interrupt is masked: encoders and step edges never wait for the main loop.
flexura::Section::Section() : before_(TIMSK5) {
  TIMSK5 = _BV(OCIE5B);
  __asm__ volatile("" ::: "memory");
}
flexura::Section::~Section() {
  __asm__ volatile("" ::: "memory");
  TIMSK5 = before_;
}

ISR(WDT_vect) {
  outputs_off();
  rig.trip(Fault::watchdog);
  marker = {kMagic, 1, 0xFE};
}

ISR(TIMER5_COMPA_vect) {
  const uint16_t due = OCR5A;
  OCR5A = due + flexura::kTickCounts;
  if (in_tick) {
    outputs_off();
    rig.trip(Fault::overrun);
    return;
  }
  in_tick = true;
  pin::busy::port() |= pin::busy::mask;
  sensors::sample();
  sensors::read(rig.inputs());
  uart::pause();                        // what is sent can wait
  sei();                                // encoders, step edges, ADC and what is received cannot
  rig.tick(outputs);
  cli();
  if (rig.active()) {                       // nothing has tripped meanwhile
    motor::drive(outputs.duty);
    motor::enable(true);
    stepper::enable(true);
    stepper::queue(outputs.steps, due + flexura::kTickCounts);
  } else {
    outputs_off();
    if (rig.state() == State::idle) sensors::reopen();
  }
  pin::busy::port() &= static_cast<uint8_t>(~pin::busy::mask);
  const uint16_t took = TCNT5 - due;
  if (took > longest) longest = took;
  sensors::resume();
  uart::resume();
  in_tick = false;
}

void setup() {
  const bool bitten = marker.magic == kMagic && marker.bites == 1 && marker.complement == 0xFE;
  marker.magic = 0;
  if (bitten && !(reset_cause & _BV(PORF))) reset_cause |= _BV(WDRF);
  build.reset = reset_cause;

  TIMSK0 = 0;                           // the Arduino core's millis(): nobody asks
  motor::begin();
  stepper::begin();
  pin::busy::direction() |= pin::busy::mask;
  pin::lamp::direction() |= pin::lamp::mask;
  sensors::begin();
  uart::begin();

  flexura::Config stored;
  rig.begin(store::load(stored) ? &stored : nullptr, reset_cause);

  TCCR5A = 0;
  TCCR5B = _BV(CS51);                   // free running at 2 MHz: control ticks by OC5A, step edges by OC5B
  OCR5A = TCNT5 + flexura::kTickCounts;
  TIFR5 = _BV(OCF5A);
  TIMSK5 = _BV(OCIE5A) | _BV(OCIE5B);
  watchdog_on();
}

namespace {

void listen() {
  uint8_t byte, answer[flexura::Link::kAnswerMaxBytes];
  for (uint8_t n = 0; n < 32 && uart::take(byte); ++n) {   // a flooded line must not keep the rest waiting
    uart::send(answer, link.take(byte, answer));
    if (!rig.active() && (pin::motor_enable::port() & pin::motor_enable::mask)) {
      const uint8_t flags = SREG;
      cli();
      outputs_off();                    // a stop does not wait for the next tick
      SREG = flags;
    }
  }
}

void keep() {
  static bool under_way;
  if (!link.saving()) {
    under_way = false;
    return;
  }
  if (!under_way) store::begin_save(rig.config());
  under_way = true;
  const store::Progress progress = store::save();
  if (progress == store::Progress::busy) return;
  uint8_t frame[flexura::kFrameMaxBytes];
  uart::send(frame, link.saved(progress == store::Progress::done, frame));
}

void speak(uint32_t now) {
  uint8_t frame[flexura::kFrameMaxBytes];
  if (!link.open()) {
    static uint32_t next = 0;
    if (static_cast<int32_t>(now - next) < 0) return;
    next = now + flexura::kAnnounceEveryTicks;
    uart::send(frame, link.announce(frame));
    return;
  }
  static uint32_t next = 0;
  if (static_cast<int32_t>(now - next) < 0) return;
  next = (now & ~(flexura::kTelemetryEveryTicks - 1UL)) + flexura::kTelemetryEveryTicks;
  if (uart::room() < 2 * flexura::kFrameMaxBytes) return link.skip();   // answers go first
  uint16_t busy;
  {
    flexura::Section section;
    busy = longest;
    longest = 0;
  }
  uart::send(frame, link.telemetry(busy, frame));
}

void light(uint32_t now) {
  const bool on = rig.state() == State::fault ? now >> 8 & 1 : rig.active();
  if (on) {
    pin::lamp::port() |= pin::lamp::mask;
  } else {
    pin::lamp::port() &= static_cast<uint8_t>(~pin::lamp::mask);
  }
}

}  // namespace

void __attribute__((noinline, used)) loop() {
  static uint32_t last = 0;
  static State before = State::idle;
  const uint32_t now = rig.now();
  if (now != last) {                    // the control interrupt lives, and so does this loop
    last = now;
    wdt_reset();
    if (before == State::fault && rig.state() == State::idle) watchdog_on();   // it may have spent its interrupt
    before = rig.state();
  }
  listen();
  if (rig.state() == State::running) rig.prepare();
  keep();
  speak(now);
  light(now);
}
