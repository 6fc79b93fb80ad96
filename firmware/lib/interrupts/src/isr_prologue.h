// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Begin and end of an interrupt handler in assembly: r24, r30 and the flags are free in between.
//
// Such handlers let no other interrupt through. So all of them may keep what they displace in the
// three general purpose registers, which takes half the cycles of the stack.
#pragma once
#ifdef __AVR__
#include <avr/interrupt.h>
#include <avr/io.h>

#define ISR_SAVE_FAST                            \
  "out %[keep_r24], r24   \n\t" /* keep r24 */   \
  "in r24, __SREG__       \n\t" /* keep flags */ \
  "out %[keep_sreg], r24  \n\t"                  \
  "out %[keep_r30], r30   \n\t" /* keep r30 */

#define ISR_RESTORE_FAST                              \
  "in r30, %[keep_r30]    \n\t" /* r30 as before */   \
  "in r24, %[keep_sreg]   \n\t" /* flags as before */ \
  "out __SREG__, r24      \n\t"                       \
  "in r24, %[keep_r24]    \n\t" /* r24 as before */

#define ISR_KEEPS                                                              \
  [keep_r24] "I"(_SFR_IO_ADDR(GPIOR0)), [keep_sreg] "I"(_SFR_IO_ADDR(GPIOR1)), \
      [keep_r30] "I"(_SFR_IO_ADDR(GPIOR2))

#endif
