/* The emulated board's state, and what its parts (wires.c, shim.c) know of each other. */
#pragma once
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "avr_ioport.h"
#include "avr_timer.h"
#include "avr_watchdog.h"
#include "sim_avr.h"

enum {
  ENCODERS = 2,
  MOTORS = 2,
  LINES = 16,
  VECTORS = 64,
  PORTS = 12,
  MCUSR = 0x54,
  WATCHDOG_RESET = 8,
  TIMSK0 = 0x6E,
  TIMERS = 6
};
enum { ON_PIN, ON_ADC };
enum {
  FORWARD = 1,
  REVERSE,
  ENABLE,
  FORWARD_2,
  REVERSE_2,
  ENABLE_2,
  STEP,
  STEP_UP,
  STEP_DISABLE,
  ROLES
}; /* what a line does for the plant; 0: only watched */

typedef struct {            /* shared with Python: all doubles, see simulator.py */
  double encoder[ENCODERS]; /* in: position at the window's end [counts, x4] */
  double duty[MOTORS]; /* out: mean of forward minus reverse while the bridge is enabled, over the
                          window, -1..1 */
  double
      steps; /* out: steps taken since the start, with sign, counted while the driver was enabled */
  double steps_mean;       /* out: mean of `steps` over the window's time */
  double motor_on[MOTORS]; /* out: 1 while the motor's driver is enabled */
  double stepper_on;       /* out: 1 while the stepper's driver is enabled */
  double driven_cycle;     /* out: the last cycle at which a bridge was enabled */
  double step_cycle;       /* out: the last cycle at which the stepper driver was enabled */
  double resets;           /* out: resets since the start, power-on not counted */
} window_t;

typedef struct {
  uint64_t cycle;
  uint8_t kind, unit, n; /* pin: port letter and bit; ADC: channel in n */
  uint16_t value;
} input_t;

typedef struct {
  uint64_t cycle;
  uint32_t line, level;
} edge_t;

typedef struct board board_t;

typedef struct {
  board_t *board;
  avr_irq_t *irq;
  uint32_t index, traced;
  uint8_t role, rest,
      level;   /* rest: the level without the firmware, given by the rig's resistors */
  uint8_t cut; /* the wire is broken: what it led to is at rest */
} line_t;

typedef struct {
  uint8_t port[2], bit[2]; /* A, B */
  int wired;
  int64_t count;
  double position;
} encoder_t;

typedef struct {
  void *at;
  size_t head, used, room, size;
} queue_t;

struct board {
  avr_t *avr;
  void (*core_reset)(avr_t *);
  int was_reset, bitten;
  avr_watchdog_t *watchdog;
  window_t window;
  queue_t inputs;  /* input_t in order of cycle */
  queue_t to_uart; /* bytes that the line still holds */
  queue_t from_uart;
  queue_t edges;                   /* edge_t of traced lines */
  uint64_t byte_cycles, next_byte; /* a byte's time on the line; when the next one has arrived */
  encoder_t encoder[ENCODERS];
  line_t lines[LINES];
  uint32_t line_count;
  uint8_t level_of[ROLES];         /* by role */
  const avr_timer_t *timer[ROLES]; /* of the compare pins, by role, and their comparators */
  const avr_timer_comp_t *comparator[ROLES];
  uint8_t cut[ROLES]; /* by role: its wire is broken */
  int unsettled;      /* a line is not at the level that simavr believes */
  int motor[MOTORS];  /* -1, 0, 1: how the pins drive the motor now */
  uint64_t motor_since[MOTORS];
  double motor_sum[MOTORS];
  uint64_t begin; /* the window's first cycle */
  double
      steps_late; /* sum of the window's steps, each by how long after its begin it came [cycles] */
  uint8_t driven[PORTS], level[PORTS]; /* inputs by port letter - 'A' */
  uint64_t stuck[PORTS];               /* bits of pins that ignore what drives them */
  uint64_t entered[VECTORS], longest[VECTORS], own[VECTORS], total[VECTORS], entries[VECTORS];
  uint32_t stack[VECTORS], depth;
  uint64_t nested[VECTORS]; /* by depth: cycles that others took meanwhile */
  char log[1 << 14];
  size_t log_used;
};

static inline void *push(queue_t *q) {
  if (q->used == q->room) {
    if (q->head > q->room / 2) {
      memmove(q->at, (char *)q->at + q->head * q->size, (q->used - q->head) * q->size);
      q->used -= q->head;
      q->head = 0;
    } else {
      q->room = q->room ? 2 * q->room : 1024;
      q->at = realloc(q->at, q->room * q->size);
      if (!q->at) abort();
    }
  }
  return (char *)q->at + q->used++ * q->size;
}

static inline size_t take(queue_t *q, void *into, size_t room) {
  size_t n = q->used - q->head;
  if (n > room) n = room;
  memcpy(into, (char *)q->at + q->head * q->size, n * q->size);
  q->head += n;
  if (q->head == q->used) q->head = q->used = 0;
  return n;
}

/* wires.c */
void schedule(board_t *b, input_t e); /* among the inputs, in order of cycle */
void deliver(board_t *b, const input_t *e);
void turn(board_t *b, encoder_t *encoder, double position, uint64_t begin, uint64_t end);
void on_drive(board_t *b); /* brings the sums up to now */
void settle(board_t *b);   /* has simavr believe what the lines are */
void rest(board_t *b);     /* as after a reset, when every pin is an input */
