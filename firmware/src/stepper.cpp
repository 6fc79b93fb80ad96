#include "stepper.h"

#include <avr/interrupt.h>

#include "pins.h"

namespace {

constexpr uint8_t kRoom = 16;                        // two ticks' worth and more
constexpr uint16_t kPulseCounts = 100;               // 50 us: longer than the edge interrupt is ever held up
constexpr uint8_t kSetOnMatch = _BV(COM5B1) | _BV(COM5B0), kClearOnMatch = _BV(COM5B1);

uint16_t edge_at[kRoom];
bool edge_up[kRoom];
uint8_t head, tail;
volatile uint8_t pulses;

bool passed(uint16_t at) { return static_cast<int16_t>(TCNT5 - at) >= -1; }

// Low by the compare unit's own latch (which a mere disconnection would leave high for the next time) and by the port behind it.
inline __attribute__((always_inline)) void low() {
  TCCR5A = kClearOnMatch;
  TCCR5C = _BV(FOC5B);
  TCCR5A = 0;
  pin::step::port() &= static_cast<uint8_t>(~pin::step::mask);
}

inline __attribute__((always_inline)) void next() {
  if (head == tail) {
    TCCR5A = 0;
    return;
  }
  const uint8_t place = tail;
  const uint16_t at = edge_at[place];
  tail = (place + 1) % kRoom;
  if (edge_up[place]) {
    pin::step_direction::port() |= pin::step_direction::mask;
  } else {
    pin::step_direction::port() &= static_cast<uint8_t>(~pin::step_direction::mask);
  }
  TCCR5A = kSetOnMatch;
  OCR5B = at;
  if (passed(at)) OCR5B = TCNT5 + 8;            // late, but not lost
}

}  // namespace

// A match with nothing connected, or one left from the last turn of the timer, is no edge.
ISR(TIMER5_COMPB_vect) {
  const uint8_t mode = TCCR5A;
  const uint16_t at = OCR5B;
  if (mode == 0 || static_cast<int16_t>(TCNT5 - at) < 0) return;
  if (mode == kSetOnMatch) {
    pulses += pin::step_direction::port() & pin::step_direction::mask ? 1 : -1;
    const uint16_t fall = at + kPulseCounts;
    TCCR5A = kClearOnMatch;
    OCR5B = fall;
    if (!passed(fall)) return;
    low();                                           // held up for longer than the pulse
  }
  next();
}

namespace stepper {

void begin() {
  pin::step::port() &= static_cast<uint8_t>(~pin::step::mask);
  pin::step_disable::port() |= pin::step_disable::mask;
  pin::step::direction() |= pin::step::mask;
  pin::step_disable::direction() |= pin::step_disable::mask;
  pin::step_direction::direction() |= pin::step_direction::mask;
}

void enable(bool on) {
  if (on) {
    pin::step_disable::port() &= static_cast<uint8_t>(~pin::step_disable::mask);
  } else {
    pin::step_disable::port() |= pin::step_disable::mask;
  }
}

void queue(const flexura::StepPlan &plan, uint16_t tick) {
  uint8_t place = head;
  for (uint8_t k = 0; k < plan.count; ++k) {
    edge_at[place] = static_cast<uint16_t>(tick + plan.at[k]);
    edge_up[place] = plan.up;
    place = (place + 1) % kRoom;
  }
  head = place;
  if (TCCR5A == 0) next();
}

void stop() {
  if (TCCR5A == kSetOnMatch && TIFR5 & _BV(OCF5B) && static_cast<int16_t>(TCNT5 - OCR5B) >= 0)
    pulses += pin::step_direction::port() & pin::step_direction::mask ? 1 : -1;   // risen, and its interrupt still to come
  low();
  head = tail;
}

uint8_t given() { return pulses; }

}  // namespace stepper
