// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Arduino Mega 2560: the control interrupt, the main loop, the watchdog. What can be tested
// elsewhere is in lib/.
#include <Arduino.h>
#include <avr/wdt.h>

#include "motor.h"
#include "pin.h"
#include "sensors.h"
#include "session.h"
#include "settings_eeprom.h"
#include "stepper.h"
#include "uart.h"

// The emergency stop is proven for one firmware: it must have its hash.
#ifndef FLEXURA_FIRMWARE_HASH
#error "build with PlatformIO, as platformio.ini says"
#endif

using flexura::Fault;
using flexura::State;

namespace {

// All that the main loop and the control interrupt keep.
struct Board {
  flexura::Rig rig;
  flexura::Build build = {
      {0, 1, 0}, {__GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__}, 0, pin::kHash};
  flexura::Session session{rig, build};

  // Control interrupt.
  flexura::Outputs outputs;
  volatile bool in_tick = false;
  volatile uint16_t longest = 0;  // since it was due, in counts of timer 5

  // Main loop.
  uint32_t last_tick = 0;
  State last_state = State::idle;
  uint32_t next_announcement = 0;
  uint32_t next_report = 0;
};
Board board;

// SRAM outlives a reset; MCUSR may not outlive the boot loader. The watchdog's interrupt writes the
// marker before the reset.
struct WatchdogMarker {
  uint16_t magic;
  uint8_t times;
  uint8_t complement;
};
WatchdogMarker marker __attribute__((section(".noinit")));
uint8_t reset_cause __attribute__((section(".noinit")));
constexpr uint16_t kMagic = 0xB17E;

void outputs_off() {
  constexpr int16_t kStill[2] = {0, 0};
  motor::drive(kStill);
  motor::enable(false, false);
  stepper::stop();
  stepper::enable(false);
}

void start_watchdog() {
  const uint8_t flags = SREG;
  cli();
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDIE) | _BV(WDE) | _BV(WDP1);  // 64 ms: interrupt; as long again: reset
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
flexura::CriticalSection::CriticalSection() : before_(TIMSK5) {
  TIMSK5 = static_cast<uint8_t>(before_ & ~_BV(OCIE5A));
  __asm__ volatile("" ::: "memory");
}
flexura::CriticalSection::~CriticalSection() {
  __asm__ volatile("" ::: "memory");
  TIMSK5 = before_;
}

flexura::InterruptLock::InterruptLock() : before_(SREG) {
  cli();
  __asm__ volatile("" ::: "memory");
}
flexura::InterruptLock::~InterruptLock() {
  __asm__ volatile("" ::: "memory");
  SREG = before_;
}

ISR(WDT_vect) {
  outputs_off();
  board.rig.trip(Fault::watchdog);
  marker = {kMagic, 1, 0xFE};
}

ISR(TIMER5_COMPA_vect) {
  const uint16_t due = OCR5A;
  OCR5A = due + flexura::kTickCounts;
  if (board.in_tick) {
    outputs_off();
    board.rig.trip(Fault::overrun);
    return;
  }
  board.in_tick = true;
  pin::set_high<pin::busy>();
  sensors::sample();
  sensors::read(board.rig.inputs());
  uart::pause();  // what is sent can wait
  sei();          // encoders, step edges and what is received cannot
  board.rig.tick(board.outputs);
  cli();
  if (board.rig.active()) {  // nothing has tripped meanwhile
    using flexura::Drive;
    motor::drive(board.outputs.duty);
    motor::enable(true, board.rig.drive(1) == Drive::motor);
    stepper::enable(board.rig.drive(1) == Drive::stepper);
    stepper::queue(board.outputs.steps, due + flexura::kTickCounts);
  } else {
    outputs_off();
    if (board.rig.state() == State::idle) sensors::reopen();
  }
  pin::set_low<pin::busy>();
  const uint16_t took = TCNT5 - due;
  if (took > board.longest) board.longest = took;
  sensors::resume();
  uart::resume();
  board.in_tick = false;
}

void setup() {
  const bool bitten = marker.magic == kMagic && marker.times == 1 && marker.complement == 0xFE;
  marker.magic = 0;
  if (bitten && !(reset_cause & _BV(PORF))) reset_cause |= _BV(WDRF);
  board.build.reset = reset_cause;

  TIMSK0 = 0;  // the Arduino core counts milliseconds: not needed here
  motor::begin();
  stepper::begin();
  pin::begin_output<pin::busy>();
  pin::begin_output<pin::lamp>();
  sensors::begin();
  uart::begin();

  flexura::Stored stored;
  const bool found = eeprom::load(stored);
  board.rig.begin(found ? &stored : nullptr, reset_cause, FLEXURA_FIRMWARE_HASH, FLEXURA_MOTORS);

  // Timer 5 runs free at 2 MHz: OC5A gives the control ticks, another output the step edges.
  TCCR5A = 0;
  TCCR5B = _BV(CS51);
  OCR5A = TCNT5 + flexura::kTickCounts;
  TIFR5 = _BV(OCF5A);
  TIMSK5 = _BV(OCIE5A);
  stepper::begin_interrupt();
  start_watchdog();
}

namespace {

// Takes what has been received; at most 32 bytes, so that a flooded line does not keep the rest
// waiting.
void poll_commands() {
  uint8_t byte;
  uint8_t answer[flexura::Session::kAnswerMaxBytes];
  for (uint8_t n = 0; n < 32 && uart::take(byte); ++n) {
    uart::send(answer, board.session.receive(byte, answer));
    if (!board.rig.active() && motor::enabled()) {
      flexura::InterruptLock lock;
      outputs_off();  // a stop does not wait for the next tick
    }
  }
}

void poll_eeprom_save() {
  if (!board.session.saving()) return;
  if (board.session.begin_saving()) eeprom::begin_save({board.rig.config(), board.rig.proven()});
  const eeprom::Progress progress = eeprom::save();
  if (progress == eeprom::Progress::busy) return;
  uint8_t frame[flexura::kFrameMaxBytes];
  uart::send(frame, board.session.saved(progress == eeprom::Progress::done, frame));
}

void announce(uint32_t now) {
  if (static_cast<int32_t>(now - board.next_announcement) < 0) return;
  board.next_announcement = now + flexura::kAnnounceEveryTicks;
  uint8_t frame[flexura::kFrameMaxBytes];
  uart::send(frame, board.session.announce(frame));
}

void report(uint32_t now) {
  constexpr uint32_t kEvery = flexura::kTelemetryEveryTicks;
  if (static_cast<int32_t>(now - board.next_report) < 0) return;
  board.next_report = (now & ~(kEvery - 1)) + kEvery;
  if (uart::room() < 2 * flexura::kFrameMaxBytes) {  // answers go first
    board.session.skip_report();
    return;
  }
  uint16_t busy;
  {
    flexura::CriticalSection section;
    busy = board.longest;
    board.longest = 0;
  }
  uint8_t frame[flexura::kFrameMaxBytes];
  uart::send(frame, board.session.telemetry(busy, frame));
}

void send_reports(uint32_t now) {
  if (board.session.open()) {
    report(now);
  } else {
    announce(now);
  }
}

// Off in Idle, on in Armed and Running, blinking in Fault.
void update_lamp(uint32_t now) {
  const bool blink = now >> 8 & 1;
  pin::set<pin::lamp>(board.rig.state() == State::fault ? blink : board.rig.active());
}

// The control interrupt lives, and so does this loop.
void feed_watchdog(uint32_t now) {
  if (now == board.last_tick) return;
  board.last_tick = now;
  wdt_reset();
  const State state = board.rig.state();
  // In a fault the watchdog may have spent its interrupt, and said so for the next reset.
  if (board.last_state == State::fault && state != State::fault) {
    marker.magic = 0;
    start_watchdog();
  }
  board.last_state = state;
}

}  // namespace

void __attribute__((noinline, used)) loop() {
  const uint32_t now = board.rig.now();
  feed_watchdog(now);
  send_reports(now);  // first: what a report says is that of its own tick
  poll_commands();
  send_reports(board.rig.now());  // a command may have taken long
  if (board.rig.state() == State::running) board.rig.prepare();
  poll_eeprom_save();
  update_lamp(now);
}
