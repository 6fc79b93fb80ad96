// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// USART 0 with rings of its own: bytes that come while the ring is full are lost, frames that do
// not fit are not begun.
#pragma once
#include <stdint.h>

namespace uart {

void begin();
bool take(uint8_t &byte);
void pause();  // nothing more is sent until resume(). Interrupts off.
void resume();
uint8_t room();                                 // bytes that may be sent now
bool send(const uint8_t *bytes, uint8_t size);  // all of them or none

}  // namespace uart
