#include "stepper.h"

#include <avr/interrupt.h>

#include "by_hand.h"
#include "pins.h"

namespace {

constexpr uint8_t kRoom = 16;                        // two ticks' worth and more
constexpr uint16_t kPulseCounts = 100;               // 50 us: longer than the edge interrupt is ever held up
constexpr uint8_t kSetOnMatch = _BV(COM5B1) | _BV(COM5B0), kClearOnMatch = _BV(COM5B1);

struct Edge {
  uint16_t at;
  bool up;
  uint8_t unused;                                    // an index shifted twice is an offset
};
Edge edges[kRoom];
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
  const uint16_t at = edges[place].at;
  tail = (place + 1) % kRoom;
  if (edges[place].up) {
    pin::step_direction::port() |= pin::step_direction::mask;
  } else {
    pin::step_direction::port() &= static_cast<uint8_t>(~pin::step_direction::mask);
  }
  TCCR5A = kSetOnMatch;
  OCR5B = at;
  if (passed(at)) OCR5B = TCNT5 + 8;            // late, but not lost
}

}  // namespace

// Both edges of a step by hand, when less than 32 us ago and when the next one is far enough away not to be missed meanwhile;
// all else is left to the handler below.
ISR(TIMER5_COMPB_vect, ISR_NAKED) {
  __asm__ volatile(BY_HAND_BEGIN
      " push r25 \n push r31 \n"
      " lds r30, %[at] \n lds r31, %[at]+1 \n lds r24, %[now] \n lds r25, %[now]+1 \n"
      " sub r24, r30 \n sbc r25, r31 \n andi r24, 0xC0 \n or r24, r25 \n brne 4f \n"
      " lds r24, %[mode] \n cpi r24, %[set] \n brne 1f \n"
      // It rose: count it by its direction, and let it fall.
      " lds r24, %[pulses] \n lds r25, %[direction] \n inc r24 \n sbrs r25, %[up] \n subi r24, 2 \n sts %[pulses], r24 \n"
      " ldi r24, %[clear] \n sts %[mode], r24 \n"
      " subi r30, lo8(-%[pulse]) \n sbci r31, hi8(-%[pulse]) \n sts %[at]+1, r31 \n sts %[at], r30 \n"
      " rjmp 3f \n"
      "4: pop r31 \n pop r25 \n" BY_HAND_END " jmp __vector_step \n"
      // It fell: disconnect, or take the next one: its direction, then its time, if that is 20 us away.
      "1: cpi r24, %[clear] \n brne 4b \n"
      " lds r30, %[tail] \n lds r24, %[head] \n sub r24, r30 \n breq 2f \n"
      " lsl r30 \n lsl r30 \n ldi r31, 0 \n subi r30, lo8(-(%[edges])) \n sbci r31, hi8(-(%[edges])) \n"
      " ldd r24, Z+2 \n lds r25, %[direction] \n ori r25, 1<<%[up] \n sbrs r24, 0 \n andi r25, 0xFF-(1<<%[up]) \n"
      " sts %[direction], r25 \n ld r24, Z \n ldd r25, Z+1 \n"
      " lds r30, %[now] \n lds r31, %[now]+1 \n sub r30, r24 \n sbc r31, r25 \n adiw r30, 40 \n brpl 4b \n"
      " ldi r30, %[set] \n sts %[mode], r30 \n sts %[at]+1, r25 \n sts %[at], r24 \n"
      " lds r24, %[tail] \n inc r24 \n andi r24, %[room]-1 \n sts %[tail], r24 \n rjmp 3f \n"
      "2: sts %[mode], r24 \n"
      "3: pop r31 \n pop r25 \n" BY_HAND_END " reti \n"
      :
      : BY_HAND_KEEPS, [mode] "n"(_SFR_MEM_ADDR(TCCR5A)), [at] "n"(_SFR_MEM_ADDR(OCR5B)), [now] "n"(_SFR_MEM_ADDR(TCNT5)),
        [set] "M"(kSetOnMatch), [clear] "M"(kClearOnMatch), [pulse] "n"(kPulseCounts), [pulses] "i"(&pulses), [edges] "i"(edges),
        [head] "i"(&head), [tail] "i"(&tail), [room] "n"(kRoom), [direction] "i"(&pin::step_direction::port()),
        [up] "I"(pin::step_direction::bit));
}
static_assert(kPulseCounts >= 100 && sizeof(Edge) == 4, "the fall is still 18 us away; two shifts");

// A match with nothing connected, or one left from the last turn of the timer, is no edge.
ISR(__vector_step) {
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
    edges[place].at = static_cast<uint16_t>(tick + plan.at[k]);
    edges[place].up = plan.up;
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
