// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "stepper.h"

#include <avr/interrupt.h>

#include "pin.h"
#include "step_isr.h"

namespace {

// Timer 5 and the pins, as StepHandler and STEP_ISR need them.
struct StepTimer {
  static constexpr uint8_t kUpBit = pin::step_direction::bit;
  static constexpr uint8_t kSetOnMatch = pin::step::set_on_match;
  static constexpr uint8_t kClearOnMatch = pin::step::clear_on_match;

  static volatile uint8_t &mode() { return TCCR5A; }
  static volatile uint16_t &compare() { return pin::step::compare(); }
  static volatile uint16_t &counter() { return TCNT5; }
  static volatile uint8_t &direction() { return pin::step_direction::port(); }

  // Low by the compare unit's own latch (a mere disconnection would leave it high for the next
  // time) and by the port behind it.
  static void force_low() {
    TCCR5A = kClearOnMatch;
    TCCR5C = pin::step::force;
    TCCR5A = 0;
    pin::set_low<pin::step>();
  }
};

using Handler = flexura::StepHandler<StepTimer>;

flexura::StepQueue steps;

}  // namespace

STEP_ISR(FLEXURA_STEP_VECTOR, StepTimer, steps, "__vector_step")
ISR(__vector_step) { Handler::match(steps); }

namespace stepper {

void begin() {
  pin::begin_output<pin::step>();
  pin::begin_output<pin::step_disable>(true);
  pin::begin_output<pin::step_direction>();
}

void begin_interrupt() { TIMSK5 |= pin::step::match_interrupt; }

void enable(bool on) { pin::set<pin::step_disable>(!on); }

void queue(const flexura::StepPlan &plan, uint16_t tick) {
  uint8_t place = steps.head;
  for (uint8_t k = 0; k < plan.count; ++k) {
    steps.edges[place].at = static_cast<uint16_t>(tick + plan.at[k]);
    steps.edges[place].up = plan.up;
    place = (place + 1) % flexura::kStepRoom;
  }
  steps.head = place;
  if (TCCR5A == 0) Handler::next(steps);
}

void stop() {
  const bool risen = TCCR5A == StepTimer::kSetOnMatch && (TIFR5 & pin::step::match_flag) &&
                     static_cast<int16_t>(TCNT5 - StepTimer::compare()) >= 0;
  if (risen) Handler::count(steps);  // its interrupt is still to come
  StepTimer::force_low();
  steps.head = steps.tail;
}

uint8_t given() { return steps.given; }

}  // namespace stepper
