// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Reading and writing pins of any port (pins.h).
#pragma once
#include <avr/interrupt.h>

#include "pins.h"

namespace pin {

template <class Pin>
inline bool is_high() {
  return Pin::input() & Pin::mask;
}

// One instruction at ports A to G. At the others the port is read, changed and written back, and
// no interrupt may change it meanwhile.
template <class Pin>
inline void set_high() {
  const uint8_t flags = SREG;
  if (!Pin::bit_addressable) cli();
  Pin::port() |= Pin::mask;
  if (!Pin::bit_addressable) SREG = flags;
}

template <class Pin>
inline void set_low() {
  const uint8_t flags = SREG;
  if (!Pin::bit_addressable) cli();
  Pin::port() &= static_cast<uint8_t>(~Pin::mask);
  if (!Pin::bit_addressable) SREG = flags;
}

template <class Pin>
inline void set(bool high) {
  if (high) {
    set_high<Pin>();
  } else {
    set_low<Pin>();
  }
}

// An output that begins low, or high.
template <class Pin>
inline void begin_output(bool high = false) {
  set<Pin>(high);
  const uint8_t flags = SREG;
  if (!Pin::bit_addressable) cli();
  Pin::direction() |= Pin::mask;
  if (!Pin::bit_addressable) SREG = flags;
}

// An input with its pull-up: a broken wire reads high.
template <class Pin>
inline void begin_input() {
  const uint8_t flags = SREG;
  if (!Pin::bit_addressable) cli();
  Pin::direction() &= static_cast<uint8_t>(~Pin::mask);
  if (!Pin::bit_addressable) SREG = flags;
  set_high<Pin>();
}

}  // namespace pin
