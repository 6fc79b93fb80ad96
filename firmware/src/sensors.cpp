// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "sensors.h"

#include <avr/interrupt.h>

#include "encoder_isr.h"
#include "pin.h"
#include "stepper.h"

using flexura::EncoderLine;

namespace {

flexura::Quadrature encoder[2];
uint8_t last_count[2];
uint8_t last_missed[2];
uint8_t last_given;

template <class A, class B>
uint8_t lines() {
  return static_cast<uint8_t>((pin::is_high<A>() ? 2 : 0) | (pin::is_high<B>() ? 1 : 0));
}
uint8_t lines_1() { return lines<pin::encoder_1_a, pin::encoder_1_b>(); }
uint8_t lines_2() { return lines<pin::encoder_2_a, pin::encoder_2_b>(); }

constexpr uint8_t kInterrupts1 =
    _BV(pin::encoder_1_a::interrupt) | _BV(pin::encoder_1_b::interrupt);
constexpr uint8_t kInterrupts2 =
    _BV(pin::encoder_2_a::interrupt) | _BV(pin::encoder_2_b::interrupt);

// 125 kHz: 104 us a conversion. The reference is 5 V, the supply of the flex sensor's divider too:
// its changes cancel.
constexpr uint8_t kConverter = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
constexpr uint8_t kReference = _BV(REFS0);
uint8_t conversions;
uint16_t sum;
volatile uint16_t flex;
volatile uint16_t supply;

void convert(uint8_t channel) {
  ADMUX = kReference | channel;
  ADCSRA = kConverter | _BV(ADIE) | _BV(ADSC);
}

void take_conversion(uint16_t result) {
  if (conversions < flexura::kAdcSamples) {
    sum += result;
    ++conversions;
    const bool more = conversions < flexura::kAdcSamples;
    convert(more ? pin::flex::channel : pin::supply::channel);
  } else {
    flex = sum;
    supply = result;
  }
}

// The interrupt of a line follows every edge.
template <class Pin>
void begin_encoder_line() {
  pin::begin_input<Pin>();
  volatile uint8_t &sense = Pin::interrupt < 4 ? EICRA : EICRB;
  const uint8_t shift = 2 * (Pin::interrupt & 3);
  sense = static_cast<uint8_t>((sense & ~(3 << shift)) | 1 << shift);
}

// A line that floods shuts its own interrupt: the control interrupt must live to say so.
template <class Pin>
void shut() {
  EIMSK &= static_cast<uint8_t>(~_BV(Pin::interrupt));
}

}  // namespace

// What the assembly of encoder_isr.h takes of a pin: I/O address and bit.
#define INPUT_OF(name) _SFR_IO_ADDR(name::input()), name::bit
#define ENCODER_LINES(number) \
  INPUT_OF(pin::encoder_##number##_a), INPUT_OF(pin::encoder_##number##_b)
#define ENCODER_LINE_A(vector, number, general) \
  ENCODER_EDGE_ISR_OF(vector, encoder[number - 1], 0, ENCODER_LINES(number), "8", "sbrs", general)
#define ENCODER_LINE_B(vector, number, general) \
  ENCODER_EDGE_ISR_OF(vector, encoder[number - 1], 1, ENCODER_LINES(number), "4", "sbrc", general)
// Expands its arguments before ENCODER_EDGE_ISR counts them.
#define ENCODER_EDGE_ISR_OF(...) ENCODER_EDGE_ISR(__VA_ARGS__)

ENCODER_LINE_A(FLEXURA_ENCODER_1_A_VECTOR, 1, "__vector_edge_1a")
ENCODER_LINE_B(FLEXURA_ENCODER_1_B_VECTOR, 1, "__vector_edge_1b")
ENCODER_LINE_A(FLEXURA_ENCODER_2_A_VECTOR, 2, "__vector_edge_2a")
ENCODER_LINE_B(FLEXURA_ENCODER_2_B_VECTOR, 2, "__vector_edge_2b")

ISR(__vector_edge_1a) {
  if (!encoder[0].update(EncoderLine::a, lines_1())) shut<pin::encoder_1_a>();
}
ISR(__vector_edge_1b) {
  if (!encoder[0].update(EncoderLine::b, lines_1())) shut<pin::encoder_1_b>();
}
ISR(__vector_edge_2a) {
  if (!encoder[1].update(EncoderLine::a, lines_2())) shut<pin::encoder_2_a>();
}
ISR(__vector_edge_2b) {
  if (!encoder[1].update(EncoderLine::b, lines_2())) shut<pin::encoder_2_b>();
}

ISR(ADC_vect) { take_conversion(ADC); }

namespace sensors {

void begin() {
  pin::begin_input<pin::emergency_stop>();
  pin::begin_input<pin::limit_low>();
  pin::begin_input<pin::limit_high>();
  begin_encoder_line<pin::encoder_1_a>();
  begin_encoder_line<pin::encoder_1_b>();
  begin_encoder_line<pin::encoder_2_a>();
  begin_encoder_line<pin::encoder_2_b>();
  DIDR0 = pin::flex::mask | pin::supply::mask;
  ADCSRA = kConverter;
  encoder[0].start(lines_1());
  encoder[1].start(lines_2());
  EIFR = kInterrupts1 | kInterrupts2;
  EIMSK |= kInterrupts1 | kInterrupts2;
}

// The first conversion begins with the tick. No interrupt of it disturbs the control interrupt,
// which goes on with resume().
void sample() {
  sum = 0;
  conversions = 0;
  ADMUX = kReference | pin::flex::channel;
  ADCSRA = kConverter | _BV(ADSC);
}

void resume() {
  if (ADCSRA & _BV(ADSC)) {
    ADCSRA = kConverter | _BV(ADIE);  // still under way (written as 0, ADSC goes on)
  } else {
    take_conversion(ADC);
  }
}

// The switches, closed to ground unless hit, pressed or broken, as bits of Flag.
uint8_t switches() {
  using flexura::Flag;
  uint8_t bits = 0;
  if (pin::is_high<pin::emergency_stop>()) bits |= 1 << static_cast<uint8_t>(Flag::emergency_stop);
  if (pin::is_high<pin::limit_low>()) bits |= 1 << static_cast<uint8_t>(Flag::limit_low);
  if (pin::is_high<pin::limit_high>()) bits |= 1 << static_cast<uint8_t>(Flag::limit_high);
  return bits;
}

void read(flexura::Inputs &in) {
  for (uint8_t j = 0; j < 2; ++j) {
    const uint8_t count = encoder[j].count;
    const uint8_t missed = encoder[j].missed;
    in.moved[j] = static_cast<int8_t>(count - last_count[j]);
    in.missed[j] = static_cast<uint8_t>(missed - last_missed[j]);
    in.edges[j][0] = encoder[j].take_edges(EncoderLine::a);
    in.edges[j][1] = encoder[j].take_edges(EncoderLine::b);
    last_count[j] = count;
    last_missed[j] = missed;
  }
  const uint8_t open = EIMSK;
  in.flooded[0] = (open & kInterrupts1) != kInterrupts1;
  in.flooded[1] = (open & kInterrupts2) != kInterrupts2;
  const uint8_t given = stepper::given();
  in.stepped = static_cast<int8_t>(given - last_given);
  last_given = given;
  in.flex = flex;
  in.supply = supply;
  in.switches = switches();
}

void reopen() { EIMSK |= kInterrupts1 | kInterrupts2; }

}  // namespace sensors
