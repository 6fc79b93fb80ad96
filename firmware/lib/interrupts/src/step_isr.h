// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The interrupt of the step timer: both edges of a step pulse come from its compare unit.
//
// A match has raised the step's line or let it fall. What follows is prepared here: the fall, or
// the next step of the queue with its direction.
//
// Cycles from call to return: rise 53 in assembly and 108 in C++, fall 84 and 125 (test_interrupts
// measures them).
#pragma once
#include <stdint.h>

namespace flexura {

constexpr uint16_t kPulseCounts = 100;  // 50 us: longer than this interrupt is ever held up
constexpr uint8_t kStepRoom = 16;       // two ticks' worth and more

struct StepEdge {
  uint16_t at;     // timer counts
  bool up;         // counter-clockwise
  uint8_t unused;  // an index shifted twice is an offset
};
static_assert(sizeof(StepEdge) == 4, "two shifts");

// Filled by the control interrupt, emptied by the step interrupt.
struct StepQueue {
  StepEdge edges[kStepRoom];
  uint8_t head;
  uint8_t tail;
  volatile uint8_t given;  // pulses, up minus down; wraps
};

// The C++ equivalent of STEP_ISR. `Timer` has: mode(), compare(), counter(), direction() as
// references; kUpBit, kSetOnMatch, kClearOnMatch; force_low().
template <class Timer>
struct StepHandler {
  static bool passed(uint16_t at) { return static_cast<int16_t>(Timer::counter() - at) >= -1; }

  // Connects the next edge of the queue, or nothing.
  static void next(StepQueue &queue) {
    if (queue.head == queue.tail) {
      Timer::mode() = 0;
      return;
    }
    const StepEdge edge = queue.edges[queue.tail];
    queue.tail = static_cast<uint8_t>((queue.tail + 1) % kStepRoom);
    if (edge.up) {
      Timer::direction() |= static_cast<uint8_t>(1 << Timer::kUpBit);
    } else {
      Timer::direction() &= static_cast<uint8_t>(~(1 << Timer::kUpBit));
    }
    Timer::mode() = Timer::kSetOnMatch;
    Timer::compare() = edge.at;
    if (passed(edge.at)) Timer::compare() = static_cast<uint16_t>(Timer::counter() + 8);
  }

  static void count(StepQueue &queue) {
    const bool up = Timer::direction() >> Timer::kUpBit & 1;
    queue.given = static_cast<uint8_t>(queue.given + (up ? 1 : 0xFF));
  }

  // A match. With nothing connected, or left from the last turn of the timer, it is no edge.
  static void match(StepQueue &queue) {
    const uint8_t mode = Timer::mode();
    const uint16_t at = Timer::compare();
    if (mode == 0 || static_cast<int16_t>(Timer::counter() - at) < 0) return;
    if (mode == Timer::kSetOnMatch) {
      count(queue);
      const uint16_t fall = static_cast<uint16_t>(at + kPulseCounts);
      Timer::mode() = Timer::kClearOnMatch;
      Timer::compare() = fall;
      if (!passed(fall)) return;
      Timer::force_low();  // held up for longer than the pulse
    }
    next(queue);
  }
};

}  // namespace flexura

#ifdef __AVR__
#include "isr_prologue.h"

// Handles an edge that is less than 32 us old, if the next one is at least 20 us away. All else is
// left, untouched, to `general`, a handler in C++ that calls StepHandler<Timer>::match.
#define STEP_ISR(vector, Timer, queue, general)                                               \
  ISR(vector, ISR_NAKED) {                                                                    \
    __asm__ volatile(                                                                         \
        ISR_SAVE_FAST                                                                         \
        "push r25                  \n\t"                                                      \
        "push r31                  \n\t"                                                      \
        "lds r30, %[at]            \n\t" /* Z = compare */                                    \
        "lds r31, %[at]+1          \n\t"                                                      \
        "lds r24, %[now]           \n\t" /* r25:r24 = counter - compare */                    \
        "lds r25, %[now]+1         \n\t"                                                      \
        "sub r24, r30              \n\t"                                                      \
        "sbc r25, r31              \n\t"                                                      \
        "andi r24, 0xC0            \n\t" /* 64 counts or more? */                             \
        "or r24, r25               \n\t"                                                      \
        "brne 4f                   \n\t" /* yes: general handler */                           \
        "lds r24, %[mode]          \n\t"                                                      \
        "cpi r24, %[set]           \n\t"                                                      \
        "brne 1f                   \n\t"                                                      \
        "lds r24, %[given]         \n\t" /* it rose: count it by its direction */             \
        "lds r25, %[direction]     \n\t"                                                      \
        "inc r24                   \n\t"                                                      \
        "sbrs r25, %[up]           \n\t"                                                      \
        "subi r24, 2               \n\t"                                                      \
        "sts %[given], r24         \n\t"                                                      \
        "ldi r24, %[clear]         \n\t" /* mode = clear on match */                          \
        "sts %[mode], r24          \n\t"                                                      \
        "subi r30, lo8(-%[pulse])  \n\t" /* compare += pulse */                               \
        "sbci r31, hi8(-%[pulse])  \n\t"                                                      \
        "sts %[at]+1, r31          \n\t"                                                      \
        "sts %[at], r30            \n\t"                                                      \
        "rjmp 3f                   \n\t"                                                      \
        "4:                        \n\t" /* general handler */                                \
        "pop r31                   \n\t"                                                      \
        "pop r25                   \n\t" ISR_RESTORE_FAST "jmp " general                      \
        "           \n\t"                                                                     \
        "1:                        \n\t" /* it fell, or nothing is connected */               \
        "cpi r24, %[clear]         \n\t"                                                      \
        "brne 4b                   \n\t" /* nothing: general handler */                       \
        "lds r30, %[tail]          \n\t"                                                      \
        "lds r24, %[head]          \n\t"                                                      \
        "sub r24, r30              \n\t" /* the queue is empty? */                            \
        "breq 2f                   \n\t"                                                      \
        "lsl r30                   \n\t" /* Z = &edges[tail] */                               \
        "lsl r30                   \n\t"                                                      \
        "ldi r31, 0                \n\t"                                                      \
        "subi r30, lo8(-(%[edges]))\n\t"                                                      \
        "sbci r31, hi8(-(%[edges]))\n\t"                                                      \
        "ldd r24, Z+2              \n\t" /* edge.up */                                        \
        "lds r25, %[direction]     \n\t" /* direction by it */                                \
        "ori r25, 1<<%[up]         \n\t"                                                      \
        "sbrs r24, 0               \n\t"                                                      \
        "andi r25, 0xFF-(1<<%[up]) \n\t"                                                      \
        "sts %[direction], r25     \n\t"                                                      \
        "ld r24, Z                 \n\t" /* r25:r24 = edge.at */                              \
        "ldd r25, Z+1              \n\t"                                                      \
        "lds r30, %[now]           \n\t" /* Z = counter - edge.at + 40 */                     \
        "lds r31, %[now]+1         \n\t"                                                      \
        "sub r30, r24              \n\t"                                                      \
        "sbc r31, r25              \n\t"                                                      \
        "adiw r30, 40              \n\t"                                                      \
        "brpl 4b                   \n\t" /* less than 20 us away: general handler */          \
        "ldi r30, %[set]           \n\t" /* mode = set on match */                            \
        "sts %[mode], r30          \n\t"                                                      \
        "sts %[at]+1, r25          \n\t" /* compare = edge.at */                              \
        "sts %[at], r24            \n\t"                                                      \
        "lds r24, %[tail]          \n\t" /* tail = (tail + 1) % room */                       \
        "inc r24                   \n\t"                                                      \
        "andi r24, %[room]-1       \n\t"                                                      \
        "sts %[tail], r24          \n\t"                                                      \
        "rjmp 3f                   \n\t"                                                      \
        "2:                        \n\t" /* empty: mode = 0 (r24) */                          \
        "sts %[mode], r24          \n\t"                                                      \
        "3:                        \n\t"                                                      \
        "pop r31                   \n\t"                                                      \
        "pop r25                   \n\t" ISR_RESTORE_FAST "reti                      \n\t"    \
        :                                                                                     \
        : ISR_KEEPS, [mode] "i"(&Timer::mode()), [at] "i"(&Timer::compare()),                 \
          [now] "i"(&Timer::counter()), [set] "M"(Timer::kSetOnMatch),                        \
          [clear] "M"(Timer::kClearOnMatch), [pulse] "n"(flexura::kPulseCounts),              \
          [given] "i"(&(queue).given), [edges] "i"((queue).edges), [head] "i"(&(queue).head), \
          [tail] "i"(&(queue).tail), [room] "n"(flexura::kStepRoom),                          \
          [direction] "i"(&Timer::direction()), [up] "I"(Timer::kUpBit));                     \
  }
static_assert(flexura::kPulseCounts >= 100, "the fall is still 18 us away");

#endif
