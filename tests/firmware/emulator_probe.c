/* A small program whose behaviour can be told from the data sheet: it tries the emulated board
 * itself (test_board_emulator.py). Each byte from the host is a command; answers are bytes. */
#define F_CPU 16000000UL
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>

static volatile uint16_t edges, ticks, stamp;

ISR(INT2_vect) {
  stamp = TCNT1;
  ++edges;
}
ISR(INT3_vect) {
  stamp = TCNT1;
  ++edges;
}
ISR(TIMER5_COMPA_vect) {
  OCR5A += 2000;
  ++ticks;
}

__attribute__((noinline)) uint8_t take(void) {
  while (!(UCSR0A & _BV(RXC0))) {
  }
  return UDR0;
}

static void give(uint8_t byte) {
  while (!(UCSR0A & _BV(UDRE0))) {
  }
  UDR0 = byte;
}

static void give16(uint16_t value) { give((uint8_t)value), give((uint8_t)(value >> 8)); }

static uint16_t take16(void) {
  const uint8_t low = take();
  return (uint16_t)(take() << 8 | low);
}

int main(void) {
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  UCSR0A = _BV(U2X0), UBRR0 = 3, UCSR0B = _BV(RXEN0) | _BV(TXEN0); /* 500 kbaud */
  DDRH = _BV(3) | _BV(4) | _BV(5), DDRL = _BV(4), DDRC = _BV(0) | _BV(1) | _BV(3), PORTC = _BV(1);
  PORTA = _BV(4) | _BV(5) | _BV(6), PORTD = _BV(2) | _BV(3); /* pull-ups */
  ICR4 = 799, TCCR4A = _BV(WGM41), TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40);
  TCCR1B = _BV(CS10);
  TCCR5B = _BV(CS51), OCR5A = 2000, TIMSK5 = _BV(OCIE5A);
  EICRA = _BV(ISC20) | _BV(ISC30), EIFR = 0xFF, EIMSK = _BV(INT2) | _BV(INT3);
  sei();
  for (;;) switch (take()) {
      case 'c': give(cause); break;
      case 'i': give(PINA); break;
      case 'p': OCR4A = take16(), TCCR4A |= _BV(COM4A1); break;
      case 'q': OCR4B = take16(), TCCR4A |= _BV(COM4B1); break;
      case 'o': TCCR4A = _BV(WGM41), PORTH &= (uint8_t)~(_BV(3) | _BV(4)); break;
      case 'e': PORTH |= _BV(5); break;
      case 'd': PORTH &= (uint8_t)~_BV(5); break;
      case 'u': PORTC = (uint8_t)((PORTC & ~3) | 1); break;
      case 'v': PORTC &= (uint8_t)~3; break;
      case 's': PORTL |= _BV(4), PORTL &= (uint8_t)~_BV(4); break;
      case 'x': TCCR5A = _BV(COM5B1) | _BV(COM5B0), OCR5B = TCNT5 + take16(); break;
      case 'y': TCCR5A = _BV(COM5B1), OCR5B = TCNT5 + take16(); break;
      case 'n': {
        cli();
        const uint16_t n = edges, t = ticks;
        sei();
        give16(n), give16(t);
      } break;
      case 't': give16(stamp); break;
      case 'm': TIMSK5 = 0; break;
      case 'M': TIMSK5 = _BV(OCIE5A); break;
      case 'a':
        ADMUX = _BV(REFS0), ADCSRA = _BV(ADEN) | _BV(ADSC) | 7;
        while (ADCSRA & _BV(ADSC)) {
        }
        give16(ADC);
        break;
      case 'k': {
        int16_t n = (int16_t)
            take16(); /* the pairs that simavr takes wrongly; avr-gcc divides by 16, 32, 64 so */
        __asm__(
            "sbrc %B0, 7 \n adiw %A0, 15 \n sbrs %B0, 7 \n sbiw %A0, 12 \n cpse %A0, %B0 \n adiw "
            "%A0, 31"
            : "+w"(n));
        give16((uint16_t)n);
      } break;
      case 'w': eeprom_write_byte((uint8_t *)7, take()); break;
      case 'r': give(eeprom_read_byte((const uint8_t *)7)); break;
    }
}
