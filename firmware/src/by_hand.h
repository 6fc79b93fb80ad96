// Begin and end of an interrupt written by hand: r24, r30 and the flags are free in between. Such handlers let no other interrupt
// through, so that all may keep what they displace in the three general purpose registers, at half the price of the stack.
#pragma once
#include <avr/io.h>

#define BY_HAND_BEGIN " out %[keep_0], r24 \n in r24, __SREG__ \n out %[keep_1], r24 \n out %[keep_2], r30 \n"
#define BY_HAND_END " in r30, %[keep_2] \n in r24, %[keep_1] \n out __SREG__, r24 \n in r24, %[keep_0] \n"
#define BY_HAND_KEEPS \
  [keep_0] "I"(_SFR_IO_ADDR(GPIOR0)), [keep_1] "I"(_SFR_IO_ADDR(GPIOR1)), [keep_2] "I"(_SFR_IO_ADDR(GPIOR2))
