// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The interrupt handlers in assembly beside their C++ equivalents, on an emulated AVR: both start
// from the same state, and must leave the same state. Registers are variables here. Timer 1 counts
// the cycles of both.
#include <string.h>

#include "check.h"
#include "encoder_isr.h"
#include "receive_isr.h"
#include "step_isr.h"

using namespace flexura;

// Cycles of a handler, called with interrupts off as the processor does (its reti lets them through
// again). What the measuring takes itself is taken off.
static uint16_t cycles(void (*handler)()) {
  cli();
  TCCR1A = 0;
  TCCR1B = _BV(CS10);
  const uint16_t begin = TCNT1;
  handler();
  cli();
  const uint16_t took = static_cast<uint16_t>(TCNT1 - begin);
  sei();
  return took;
}
static void return_only() __attribute__((naked, noinline));
static void return_only() { __asm__ volatile("reti"); }

// ---- encoder: PORTA stands for the pins of both lines, at bits 5 (A) and 2 (B)

static Quadrature encoder;
static uint8_t lines() { return static_cast<uint8_t>((PORTA >> 5 & 1) << 1 | (PORTA >> 2 & 1)); }
static bool open_a;
static bool open_b;

ENCODER_EDGE_ISR(INT0_vect, encoder, 0, _SFR_IO_ADDR(PORTA), 5, _SFR_IO_ADDR(PORTA), 2, "8", "sbrs",
                 "__vector_general_a")
ENCODER_EDGE_ISR(INT1_vect, encoder, 1, _SFR_IO_ADDR(PORTA), 5, _SFR_IO_ADDR(PORTA), 2, "4", "sbrc",
                 "__vector_general_b")
ISR(__vector_general_a) { open_a = encoder.update(EncoderLine::a, lines()); }
ISR(__vector_general_b) { open_b = encoder.update(EncoderLine::b, lines()); }

static bool same(const Quadrature &a, const Quadrature &b) { return !memcmp(&a, &b, sizeof a); }

static void encoder_edges_as_in_cpp() {
  static const uint8_t kEdges[] = {0, 1, 37, 38, 39, 40, 255};
  static const uint8_t kCounts[] = {0, 1, 127, 128, 255};
  for (uint8_t before = 0; before < 4; ++before)
    for (uint8_t now = 0; now < 4; ++now)
      for (uint8_t line = 0; line < 2; ++line)
        for (uint8_t edges : kEdges)
          for (uint8_t count : kCounts) {
            Quadrature start;
            start.start(before);
            start.count = count;
            start.edges[line] = edges;
            PORTA = static_cast<uint8_t>((now & 2 ? 0x20 : 0) | (now & 1 ? 0x04 : 0) | 0x99);
            encoder = start;
            open_a = true;
            open_b = true;
            cli();
            line ? INT1_vect() : INT0_vect();
            Quadrature wanted = start;
            const bool open = wanted.update(static_cast<EncoderLine>(line), now);
            CHECK(same(encoder, wanted) && (line ? open_b : open_a) == open);
          }
}

static void encoder_edges_are_faster() {
  const uint16_t base = cycles(return_only);
  encoder = Quadrature();
  PORTA = 0x20;
  const uint16_t by_hand = static_cast<uint16_t>(cycles(INT0_vect) - base);
  encoder = Quadrature();
  const uint16_t in_cpp = static_cast<uint16_t>(cycles(__vector_general_a) - base);
  CHECK(encoder.count == 1);
  report_number("encoder edge in assembly", by_hand);
  report_number("encoder edge in C++", in_cpp);
  CHECK(by_hand < 50 && by_hand + 20 < in_cpp);
}

// ---- received byte

static ReceiveRing ring;
static ReceiveRing expected;
static volatile uint8_t data;
RECEIVE_ISR(USART1_RX_vect, data, ring)
ISR(__vector_receive) { receive(ring, data); }

static void received_bytes_as_in_cpp() {
  for (uint16_t k = 0; k < 1500; ++k) {
    const uint8_t head = static_cast<uint8_t>(k * 7);
    const uint8_t tail = static_cast<uint8_t>(k & 3 ? k * 11 >> 3 : head + 1);
    memset(ring.bytes, 0x55, sizeof ring.bytes);
    ring.head = head;
    ring.tail = tail;
    expected = ring;
    data = static_cast<uint8_t>(k * 13);
    cli();
    USART1_RX_vect();
    receive(expected, data);
    CHECK(!memcmp(&ring, &expected, sizeof ring));
  }
}

static void received_bytes_are_faster() {
  const uint16_t base = cycles(return_only);
  ring.head = 3;
  ring.tail = 0;
  const uint16_t by_hand = static_cast<uint16_t>(cycles(USART1_RX_vect) - base);
  const uint16_t in_cpp = static_cast<uint16_t>(cycles(__vector_receive) - base);
  CHECK(ring.head == 5);
  report_number("received byte in assembly", by_hand);
  report_number("received byte in C++", in_cpp);
  CHECK(by_hand < 45 && by_hand + 10 < in_cpp);
}

// ---- steps

struct Registers {
  uint8_t mode;
  uint16_t compare;
  uint16_t counter;
  uint8_t direction;
  uint8_t forced;
};
static Registers timer;
static StepQueue queue;

struct TestTimer {
  static constexpr uint8_t kUpBit = 3;
  static constexpr uint8_t kSetOnMatch = _BV(COM5B1) | _BV(COM5B0);
  static constexpr uint8_t kClearOnMatch = _BV(COM5B1);
  static volatile uint8_t &mode() { return timer.mode; }
  static volatile uint16_t &compare() { return timer.compare; }
  static volatile uint16_t &counter() { return timer.counter; }
  static volatile uint8_t &direction() { return timer.direction; }
  static void force_low() {
    ++timer.forced;
    timer.mode = 0;
  }
};
STEP_ISR(TIMER5_COMPB_vect, TestTimer, queue, "__vector_step")
ISR(__vector_step) { StepHandler<TestTimer>::match(queue); }

static uint32_t seed = 1;
static uint16_t random16() {
  seed ^= seed << 13;
  seed ^= seed >> 17;
  seed ^= seed << 5;
  return static_cast<uint16_t>(seed >> 8);
}

// Times around those at which the two hand over to each other.
static void set_up_step(uint16_t k) {
  static const int16_t kLate[] = {0, 1, 2, 62, 63, 64, 65, 98, 99, 100, 101, 300, -1, -2, 32767};
  static const int16_t kAhead[] = {38, 39, 40, 41, 42, 1, 0, -1, 500, 2000, -300, 32700};
  static const uint8_t kModes[] = {0, TestTimer::kSetOnMatch, TestTimer::kClearOnMatch};
  timer.counter = random16();
  timer.compare = static_cast<uint16_t>(timer.counter - kLate[k % 15]);
  timer.mode = kModes[k / 15 % 3];
  timer.direction = static_cast<uint8_t>(random16());
  timer.forced = 0;
  queue.given = static_cast<uint8_t>(random16());
  queue.tail = static_cast<uint8_t>(random16() % kStepRoom);
  queue.head = static_cast<uint8_t>((queue.tail + k / 45 % 3) % kStepRoom);
  for (StepEdge &edge : queue.edges) {
    edge.at = static_cast<uint16_t>(timer.counter + kAhead[random16() % 12]);
    edge.up = random16() & 1;
  }
}

static void steps_as_in_cpp() {
  for (uint16_t k = 0; k < 4500; ++k) {
    set_up_step(k);
    const Registers registers = timer;
    const StepQueue steps = queue;
    cli();
    TIMER5_COMPB_vect();
    const Registers got = timer;
    const StepQueue left = queue;
    timer = registers;
    queue = steps;
    StepHandler<TestTimer>::match(queue);
    CHECK(!memcmp(&got, &timer, sizeof got) && !memcmp(&left, &queue, sizeof left));
  }
}

static uint16_t step_cycles(void (*handler)(), uint8_t mode) {
  timer.counter = 1000;
  timer.compare = 998;
  timer.mode = mode;
  queue.head = 1;
  queue.tail = 0;
  queue.edges[0].at = 1300;
  queue.edges[0].up = true;
  return static_cast<uint16_t>(cycles(handler) - cycles(return_only));
}

static void steps_are_faster() {
  const uint16_t rise = step_cycles(TIMER5_COMPB_vect, TestTimer::kSetOnMatch);
  const uint16_t rise_in_cpp = step_cycles(__vector_step, TestTimer::kSetOnMatch);
  const uint16_t fall = step_cycles(TIMER5_COMPB_vect, TestTimer::kClearOnMatch);
  const uint16_t fall_in_cpp = step_cycles(__vector_step, TestTimer::kClearOnMatch);
  report_number("rise in assembly", rise);
  report_number("rise in C++", rise_in_cpp);
  report_number("fall in assembly", fall);
  report_number("fall in C++", fall_in_cpp);
  CHECK(rise + 20 < rise_in_cpp && fall + 20 < fall_in_cpp);
}

static void tests() {
  RUN(encoder_edges_as_in_cpp);
  RUN(encoder_edges_are_faster);
  RUN(received_bytes_as_in_cpp);
  RUN(received_bytes_are_faster);
  RUN(steps_as_in_cpp);
  RUN(steps_are_faster);
}
CHECK_MAIN(tests())
