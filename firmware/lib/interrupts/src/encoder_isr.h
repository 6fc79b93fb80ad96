// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// The interrupt of one encoder line.
//
// The ordinary edge (of this line alone, and no flood) is handled in assembly. All else is left,
// untouched, to `general`, a handler in C++ that calls Quadrature::update: the equivalent of both.
// The unit tests (test_interrupts) run both on all states and compare.
//
// Cycles from call to return: 35 in assembly, 87 in C++ (test_interrupts measures them). The two
// encoders give up to twenty edges a millisecond.
#pragma once
#ifdef __AVR__
#include "isr_prologue.h"
#include "quadrature.h"

// vector: the interrupt. encoder: a Quadrature. line: 0 for A, 1 for B. port_a, bit_a, port_b,
// bit_b: I/O addresses below 0x20 and bits of the two lines. changed: "8" for A, "4" for B.
// skip_if_up: "sbrs" for A, "sbrc" for B. general: name of the handler of all other edges.
#define ENCODER_EDGE_ISR(vector, encoder, line, port_a, bit_a, port_b, bit_b, changed, skip_if_up, \
                         general)                                                                  \
  ISR(vector, ISR_NAKED) {                                                                         \
    __asm__ volatile(                                                                              \
        ISR_SAVE_FAST                                                                              \
        "ldi r24, 0              \n\t" /* lines << 2: A in bit 3, B in bit 2 */                    \
        "sbic %[in_a], %[at_a]   \n\t" /* if A is high */                                          \
        "ori r24, 8              \n\t"                                                             \
        "sbic %[in_b], %[at_b]   \n\t" /* if B is high */                                          \
        "ori r24, 4              \n\t"                                                             \
        "lds r30, %[last]        \n\t"                                                             \
        "eor r30, r24            \n\t" /* the lines that changed */                                \
        "cpi r30, " changed                                                                        \
        "     \n\t"                    /* this one alone? */                                       \
        "brne 1f                 \n\t" /* no: general handler */                                   \
        "lds r30, %[edges]       \n\t"                                                             \
        "inc r30                 \n\t" /* ++edges[line] */                                         \
        "cpi r30, %[most]        \n\t"                                                             \
        "brsh 1f                 \n\t" /* a flood: general handler */                              \
        "sts %[edges], r30       \n\t"                                                             \
        "sts %[last], r24        \n\t"                                                             \
        "subi r24, -4            \n\t" /* now bit 3 = A xor B */                                   \
        "lds r30, %[count]       \n\t"                                                             \
        "inc r30                 \n\t" /* up: ++count */                                           \
        skip_if_up                                                                                 \
        " r24, 3        \n\t"          /* A: up if A != B; B: up if A == B */                      \
        "subi r30, 2             \n\t" /* down: --count */                                         \
        "sts %[count], r30       \n\t" ISR_RESTORE_FAST                                            \
        "reti                    \n\t"                                                             \
        "1:                      \n\t" ISR_RESTORE_FAST "jmp " general "         \n\t"             \
        :                                                                                          \
        : ISR_KEEPS, [in_a] "I"(port_a), [at_a] "I"(bit_a), [in_b] "I"(port_b), [at_b] "I"(bit_b), \
          [last] "i"(&(encoder).last), [edges] "i"(&(encoder).edges[line]),                        \
          [count] "i"(&(encoder).count), [most] "M"(flexura::Quadrature::kEdgesMax));              \
  }

#endif
