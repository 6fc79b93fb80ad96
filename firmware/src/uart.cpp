// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "declaration.h"
#include "receive_isr.h"

namespace {
flexura::ReceiveRing received;
uint8_t sent[256];  // indices of one byte wrap by themselves
volatile uint8_t sent_head;
volatile uint8_t sent_tail;
constexpr uint8_t kReceiving = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}  // namespace

RECEIVE_ISR(USART0_RX_vect, UDR0, received)

ISR(USART0_UDRE_vect) {
  const uint8_t tail = sent_tail;
  const uint8_t next = static_cast<uint8_t>(tail + 1);
  UDR0 = sent[tail];
  sent_tail = next;
  if (next == sent_head) UCSR0B = kReceiving;
}

namespace uart {

void begin() {
  UCSR0A = _BV(U2X0);
  UBRR0 = F_CPU / 8 / flexura::kBaudBitS - 1;  // 3: 500 kbit/s without error
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = kReceiving;
}

void pause() { UCSR0B = kReceiving; }

void resume() {
  if (sent_tail != sent_head) UCSR0B = kReceiving | _BV(UDRIE0);
}

bool take(uint8_t &byte) {
  const uint8_t tail = received.tail;
  if (tail == received.head) return false;
  byte = received.bytes[tail];
  received.tail = static_cast<uint8_t>(tail + 1);
  return true;
}

uint8_t room() { return static_cast<uint8_t>(sent_tail - sent_head - 1); }

bool send(const uint8_t *bytes, uint8_t size) {
  if (size == 0) return true;
  if (size > room()) return false;
  uint8_t head = sent_head;
  while (size--) sent[head++] = *bytes++;
  __asm__ volatile("" ::: "memory");  // the bytes are there before the interrupt may see them
  sent_head = head;
  UCSR0B = kReceiving | _BV(UDRIE0);
  return true;
}

}  // namespace uart
