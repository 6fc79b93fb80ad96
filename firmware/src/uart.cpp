#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "declaration.h"

namespace {
uint8_t received[256], sent[256];                    // indices of one byte wrap by themselves
volatile uint8_t received_head, received_tail, sent_head, sent_tail;
}  // namespace

ISR(USART0_RX_vect) {
  const uint8_t byte = UDR0, head = received_head;
  if (static_cast<uint8_t>(head + 1) == received_tail) return;
  received[head] = byte;
  received_head = head + 1;
}

ISR(USART0_UDRE_vect) {
  const uint8_t tail = sent_tail;
  UDR0 = sent[tail];
  sent_tail = tail + 1;
  if (static_cast<uint8_t>(tail + 1) == sent_head) UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

namespace uart {

void begin() {
  UCSR0A = _BV(U2X0);
  UBRR0 = F_CPU / 8 / flexura::kBaudBitS - 1;        // 3: 500 kbit/s without error
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

bool take(uint8_t &byte) {
  const uint8_t tail = received_tail;
  if (tail == received_head) return false;
  byte = received[tail];
  received_tail = tail + 1;
  return true;
}

uint8_t room() { return static_cast<uint8_t>(sent_tail - sent_head - 1); }

bool send(const uint8_t *bytes, uint8_t size) {
  if (size == 0 || size > room()) return size == 0;
  uint8_t head = sent_head;
  while (size--) sent[head++] = *bytes++;
  __asm__ volatile("" ::: "memory");                 // the bytes are there before the interrupt may see them
  sent_head = head;
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0) | _BV(UDRIE0);
  return true;
}

}  // namespace uart
