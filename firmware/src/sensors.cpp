#include "sensors.h"

#include <avr/interrupt.h>

#include "by_hand.h"
#include "pins.h"
#include "quadrature.h"
#include "stepper.h"

using flexura::EncoderLine;

namespace {

flexura::Quadrature encoder[2];
uint8_t last_count[2], last_missed[2], last_given;

// Both lines in one reading: A is the higher bit of two neighbours.
uint8_t lines_1() { return PIND >> pin::encoder_1_b::bit & 3; }
uint8_t lines_2() { return PINE >> pin::encoder_2_b::bit & 3; }
static_assert(pin::encoder_1_a::bit == pin::encoder_1_b::bit + 1 && pin::encoder_2_a::bit == pin::encoder_2_b::bit + 1, "neighbours");
static_assert(pin::limit_low::bit == pin::emergency_stop::bit + 1 && pin::limit_high::bit == pin::emergency_stop::bit + 2,
              "in the order of Flag");

constexpr uint8_t kLines1 = _BV(INT2) | _BV(INT3), kLines2 = _BV(INT4) | _BV(INT5);
constexpr uint8_t kFlexChannel = pin::flex::bit, kSupplyChannel = pin::supply::bit;
constexpr uint8_t kConverter = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);   // 125 kHz: 104 us a conversion
constexpr uint8_t kReference = _BV(REFS0);           // 5 V, the supply of the flex sensor's divider too: its changes cancel
uint8_t conversions;
uint16_t sum;
volatile uint16_t flex, supply;

void convert(uint8_t channel) {
  ADMUX = kReference | channel;
  ADCSRA = kConverter | _BV(ADIE) | _BV(ADSC);
}

void next(uint16_t result) {
  if (conversions < flexura::kAdcSamples) {
    sum += result;
    convert(++conversions < flexura::kAdcSamples ? kFlexChannel : kSupplyChannel);
  } else {
    flex = sum;
    supply = result;
  }
}

}  // namespace

// Twenty edges a millisecond: 46 cycles each with entry and exit, where the compiler's own handler takes 84. The ordinary edge,
// of this line alone and no flood, is done by hand; whatever else may come is left, untouched, to Quadrature in the handlers below.
// `shift` brings A to bit 3 and B to bit 2; adding 4 then makes bit 3 their exclusive or: counting up after an edge of A.
#define EDGE(vector, line, lines, shift, joint, changed, skip_if_up, any_edge)                                            \
  ISR(vector, ISR_NAKED) {                                                                                                \
    __asm__ volatile(BY_HAND_BEGIN                                                                                        \
        " in r24, %[pins] \n" shift " andi r24, 0x0C \n"                                                                  \
        " lds r30, %[last] \n eor r30, r24 \n cpi r30, " changed " \n brne 1f \n"                                         \
        " lds r30, %[edges] \n inc r30 \n cpi r30, %[most] \n brsh 1f \n sts %[edges], r30 \n"                            \
        " sts %[last], r24 \n subi r24, -4 \n"                                                                            \
        " lds r30, %[count] \n inc r30 \n " skip_if_up " r24, 3 \n subi r30, 2 \n sts %[count], r30 \n"                   \
        BY_HAND_END " reti \n"                                                                                            \
        "1: \n" BY_HAND_END " jmp " any_edge " \n"                                                                        \
        :                                                                                                                 \
        : BY_HAND_KEEPS, [pins] "I"(_SFR_IO_ADDR(lines)), [last] "i"(&encoder[joint].last_),                              \
          [edges] "i"(&encoder[joint].edges_[line]), [count] "i"(&encoder[joint].count_),                                 \
          [most] "M"(flexura::Quadrature::kEdgesMost));                                                                   \
  }
EDGE(INT3_vect, 0, PIND, "", 0, "8", "sbrs", "__vector_edge_1a")
EDGE(INT2_vect, 1, PIND, "", 0, "4", "sbrc", "__vector_edge_1b")
EDGE(INT5_vect, 0, PINE, " lsr r24 \n lsr r24 \n", 1, "8", "sbrs", "__vector_edge_2a")
EDGE(INT4_vect, 1, PINE, " lsr r24 \n lsr r24 \n", 1, "4", "sbrc", "__vector_edge_2b")
static_assert(pin::encoder_1_b::bit == 2 && pin::encoder_2_b::bit == 4, "where EDGE looks for them");

// A line that floods shuts its own interrupt: the control interrupt must live to say so.
ISR(__vector_edge_1a) {
  if (!encoder[0].update(EncoderLine::a, lines_1())) EIMSK &= static_cast<uint8_t>(~_BV(INT3));
}
ISR(__vector_edge_1b) {
  if (!encoder[0].update(EncoderLine::b, lines_1())) EIMSK &= static_cast<uint8_t>(~_BV(INT2));
}
ISR(__vector_edge_2a) {
  if (!encoder[1].update(EncoderLine::a, lines_2())) EIMSK &= static_cast<uint8_t>(~_BV(INT5));
}
ISR(__vector_edge_2b) {
  if (!encoder[1].update(EncoderLine::b, lines_2())) EIMSK &= static_cast<uint8_t>(~_BV(INT4));
}

ISR(ADC_vect) { next(ADC); }

namespace sensors {

void begin() {
  constexpr uint8_t kSwitches = pin::emergency_stop::mask | pin::limit_low::mask | pin::limit_high::mask;
  pin::emergency_stop::port() |= kSwitches;          // pull-ups: a broken wire reads as an open switch
  PORTD |= pin::encoder_1_a::mask | pin::encoder_1_b::mask;
  PORTE |= pin::encoder_2_a::mask | pin::encoder_2_b::mask;
  DIDR0 = pin::flex::mask | pin::supply::mask;
  ADCSRA = kConverter;
  encoder[0].start(lines_1());
  encoder[1].start(lines_2());
  EICRA |= _BV(ISC20) | _BV(ISC30);                  // every edge
  EICRB |= _BV(ISC40) | _BV(ISC50);
  EIFR = _BV(INTF2) | _BV(INTF3) | _BV(INTF4) | _BV(INTF5);
  EIMSK |= kLines1 | kLines2;
}

// The first conversion begins with the tick; no interrupt of it disturbs the control interrupt, which goes on with resume().
void sample() {
  sum = 0;
  conversions = 0;
  ADMUX = kReference | kFlexChannel;
  ADCSRA = kConverter | _BV(ADSC);
}

void resume() {
  if (ADCSRA & _BV(ADSC)) {
    ADCSRA = kConverter | _BV(ADIE);               // still under way (written as 0, ADSC goes on)
  } else {
    next(ADC);
  }
}

void read(flexura::Inputs &in) {
  for (uint8_t j = 0; j < 2; ++j) {
    const uint8_t count = encoder[j].count(), missed = encoder[j].missed();
    in.moved[j] = static_cast<int8_t>(count - last_count[j]);
    in.missed[j] = static_cast<uint8_t>(missed - last_missed[j]);
    in.edges[j][0] = encoder[j].take_edges(EncoderLine::a);
    in.edges[j][1] = encoder[j].take_edges(EncoderLine::b);
    last_count[j] = count;
    last_missed[j] = missed;
  }
  const uint8_t open = EIMSK;
  in.flooded[0] = (open & kLines1) != kLines1;
  in.flooded[1] = (open & kLines2) != kLines2;
  const uint8_t given = stepper::given();
  in.stepped = static_cast<int8_t>(given - last_given);
  last_given = given;
  in.flex = flex;
  in.supply = supply;
  in.switches = PINA >> pin::emergency_stop::bit & 7;
}

void reopen() { EIMSK |= kLines1 | kLines2; }

}  // namespace sensors
