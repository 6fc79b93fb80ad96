/* An ATmega2560 with its wires, stepped in lockstep with a plant: a flat C interface to simavr for ctypes.
 *
 * The plant sees averages over a window of cycles (motor duty, steps); the firmware sees every edge at its own cycle. All that
 * crosses this border is the block `window_t`, plain C functions for what is rare, and two byte streams.
 *
 * Written for simavr 1.6. Worked around here:
 *   - its UART sleeps on the host while firmware polls it, and prints: flags cleared;
 *   - its sleep() follows the wall clock: replaced;
 *   - a pull-up overwrites a driven input at the next write to that port: AVR_IOCTL_IOPORT_SET_EXTERNAL;
 *   - a reset forgets the levels of input pins: written again;
 *   - an INTn pin that is low before its edge is chosen is polled every cycle: strict level trigger off;
 *   - fast PWM with OCRnx at TOP, which is always on, shows no level at the pin: read from the registers;
 *   - a timer's interrupt that falls due while it is masked is forgotten: raised when it is unmasked;
 *   - a byte of the UART takes 11 bit times, not 10 (left as it is: slower than the hardware).
 */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_adc.h"
#include "avr_eeprom.h"
#include "avr_extint.h"
#include "avr_ioport.h"
#include "avr_timer.h"
#include "avr_uart.h"
#include "sim_avr.h"
#include "sim_elf.h"

enum { ENCODERS = 2, LINES = 16, VECTORS = 64, PORTS = 12, MCUSR = 0x54, TIMSK0 = 0x6E, TIMERS = 6 };
enum { ON_PIN, ON_ADC };
enum { FORWARD = 1, REVERSE, ENABLE, STEP, STEP_UP, STEP_DISABLE }; /* what a line does for the plant; 0: only watched */

typedef struct { /* shared with Python: all doubles, see emulator.py */
  double encoder[ENCODERS]; /* in: position at the window's end [counts, x4] */
  double duty;              /* out: mean of forward minus reverse while the bridge is enabled, over the window, -1..1 */
  double steps;             /* out: steps taken since the start, with sign, counted while the driver was enabled */
  double motor_on;          /* out: 1 while the motor's driver is enabled */
  double stepper_on;        /* out: 1 while the stepper's driver is enabled */
  double driven_cycle;      /* out: the last cycle at which the bridge was enabled */
  double step_cycle;        /* out: the last cycle at which the stepper driver was enabled */
  double resets;            /* out: resets since the start, power-on not counted */
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
  uint8_t role, rest, level; /* rest: the level without the firmware, given by the rig's resistors */
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
  int was_reset;
  window_t window;
  queue_t inputs;   /* input_t in order of cycle */
  queue_t to_uart;  /* bytes that the line still holds */
  queue_t from_uart;
  queue_t edges;    /* edge_t of traced lines */
  uint64_t byte_cycles, next_byte; /* a byte's time on the line; when the next one has arrived */
  encoder_t encoder[ENCODERS];
  line_t lines[LINES];
  uint32_t line_count;
  uint8_t level_of[8]; /* by role */
  const avr_timer_t *timer[3]; /* of the PWM pins, by role, and their comparators */
  const avr_timer_comp_t *comparator[3];
  int motor;           /* -1, 0, 1: how the pins drive the motor now */
  uint64_t motor_since;
  double motor_sum;
  uint8_t driven[PORTS], level[PORTS]; /* inputs by port letter - 'A' */
  uint64_t stuck[PORTS];               /* bits of pins that ignore what drives them */
  uint64_t entered[VECTORS], longest[VECTORS], total[VECTORS], entries[VECTORS];
  uint32_t stack[VECTORS], depth;
  avr_symbol_t **symbols;
  uint32_t symbol_count;
  char log[1 << 14];
  size_t log_used;
};

/* ---- queues */

static void *push(queue_t *q) {
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

static size_t take(queue_t *q, void *into, size_t room) {
  size_t n = q->used - q->head;
  if (n > room) n = room;
  memcpy(into, (char *)q->at + q->head * q->size, n * q->size);
  q->head += n;
  if (q->head == q->used) q->head = q->used = 0;
  return n;
}

static void schedule(board_t *b, input_t e) {
  push(&b->inputs);
  input_t *at = b->inputs.at;
  size_t i = b->inputs.used - 1;
  for (; i > b->inputs.head && at[i - 1].cycle > e.cycle; --i) at[i] = at[i - 1];
  at[i] = e;
}

/* ---- what the firmware sees */

static void drive_pin(board_t *b, char port, int bit, int level) {
  const int p = port - 'A', mask = 1 << bit;
  if (b->stuck[p] & mask) return;
  b->driven[p] |= mask;
  b->level[p] = (uint8_t)((b->level[p] & ~mask) | (level ? mask : 0));
  avr_ioport_external_t external = {.name = port, .mask = b->driven[p], .value = b->level[p]};
  avr_ioctl(b->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
  avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit), (uint32_t)!!level);
}

static avr_ioport_t *port_of(avr_t *avr, char name) {
  for (avr_io_t *io = avr->io_port; io; io = io->next)
    if (!strcmp(io->kind, "port") && ((avr_ioport_t *)io)->name == name) return (avr_ioport_t *)io;
  return NULL;
}

static void deliver(board_t *b, const input_t *e) {
  if (e->kind == ON_PIN) drive_pin(b, (char)e->unit, e->n, e->value);
  else avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_ADC_GETIRQ, e->n), e->value);
}

static const uint8_t gray[4] = {0, 1, 3, 2}; /* of a count's last two bits; bit 0: A, bit 1: B */

/* A shaft that moves evenly from its last position to `position` between two cycles; A leads B upwards. */
static void turn(board_t *b, encoder_t *encoder, double position, uint64_t begin, uint64_t end) {
  const int64_t goal = (int64_t)floor(position);
  if (goal != encoder->count) {
    const double scale = (double)(end - begin) / (position - encoder->position);
    const int up = goal > encoder->count;
    while (encoder->count != goal) {
      const double crossed = (double)(up ? encoder->count + 1 : encoder->count);
      const uint8_t old = gray[encoder->count & 3];
      encoder->count += up ? 1 : -1;
      const uint8_t now = gray[encoder->count & 3];
      const int which = (old ^ now) >> 1;
      schedule(b, (input_t){begin + (uint64_t)((crossed - encoder->position) * scale), ON_PIN, encoder->port[which],
                            encoder->bit[which], (now >> which) & 1});
    }
  }
  encoder->position = position;
}

/* ---- what the firmware does */

static int always_on(const board_t *b, int role) {
  const avr_timer_comp_t *comparator = b->comparator[role];
  if (!comparator || avr_regbit_get(b->avr, comparator->com) != avr_timer_com_clear) return 0;
  const uint8_t *data = b->avr->data;
  const avr_timer_t *timer = b->timer[role];
  return (data[comparator->r_ocr] | data[comparator->r_ocrh] << 8) >= (data[timer->r_icr] | data[timer->r_icrh] << 8);
}

/* The drivers' inputs changed: what they did until now goes into the sums. */
static void on_drive(board_t *b) {
  const uint64_t now = b->avr->cycle;
  window_t *w = &b->window;
  b->motor_sum += b->motor * (double)(now - b->motor_since);
  b->motor_since = now;
  if (w->motor_on != 0) w->driven_cycle = (double)now;
  if (w->stepper_on != 0) w->step_cycle = (double)now;
  w->motor_on = b->level_of[ENABLE];
  w->stepper_on = !b->level_of[STEP_DISABLE];
  const int forward = b->level_of[FORWARD] || always_on(b, FORWARD), reverse = b->level_of[REVERSE] || always_on(b, REVERSE);
  b->motor = b->level_of[ENABLE] ? forward - reverse : 0;
}

static void on_edge(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  line_t *line = param;
  board_t *b = line->board;
  const uint8_t level = value & 1;
  if (level == line->level) return;
  line->level = level;
  if (line->traced) *(edge_t *)push(&b->edges) = (edge_t){b->avr->cycle, line->index, level};
  b->level_of[line->role] = level;
  if (line->role == STEP && level && b->window.stepper_on != 0) b->window.steps += b->level_of[STEP_UP] ? 1 : -1;
  else if (line->role) on_drive(b);
}

static void on_timer(struct avr_irq_t *irq, uint32_t value, void *param) { (void)irq, (void)value, on_drive(param); }

static void on_tx(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  *(uint8_t *)push(&((board_t *)param)->from_uart) = (uint8_t)value;
}

static void on_interrupt(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  board_t *b = param;
  const uint64_t now = b->avr->cycle;
  if (b->avr->interrupts.running_ptr == b->depth) { /* about to be entered */
    if (value >= VECTORS || b->depth == VECTORS) return;
    if (!b->depth) b->entered[0] = now; /* 0 stands for all of them */
    b->stack[b->depth++] = value;
    b->entered[value] = now;
    ++b->entries[value], ++b->entries[0];
  } else if (b->depth) {
    const uint32_t vector = b->stack[--b->depth];
    const uint64_t took = now - b->entered[vector];
    if (took > b->longest[vector]) b->longest[vector] = took;
    b->total[vector] += took;
    if (!b->depth) b->total[0] += now - b->entered[0];
  }
}

/* A timer's mask was written: what fell due behind it and is let through now is due now, as the flag in TIFRn says. */
static void on_mask(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value;
  board_t *b = param;
  for (int i = 0; i < b->avr->interrupts.vector_count; ++i) {
    avr_int_vector_t *vector = b->avr->interrupts.vector[i];
    if (vector->enable.reg < TIMSK0 || vector->enable.reg >= TIMSK0 + TIMERS || vector->pending) continue;
    if (avr_regbit_get(b->avr, vector->enable) && avr_regbit_get(b->avr, vector->raised)) avr_raise_interrupt(b->avr, vector);
  }
}

/* ---- simavr's hooks */

static void on_log(avr_t *avr, const int level, const char *format, va_list ap) {
  board_t *b = avr ? avr->custom.data : NULL;
  if (!b || (level != LOG_ERROR && level != LOG_WARNING)) return;
  const size_t left = sizeof b->log - b->log_used;
  const int n = vsnprintf(b->log + b->log_used, left, format, ap);
  if (n > 0) b->log_used += (size_t)n < left ? (size_t)n : left - 1;
}

static void on_reset(avr_t *avr) {
  board_t *b = avr->custom.data;
  if (b->core_reset) b->core_reset(avr);
  b->was_reset = 1;
}

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr, (void)cycles; }

static avr_cycle_count_t wake(avr_t *avr, avr_cycle_count_t when, void *param) { return (void)avr, (void)when, (void)param, 0; }

/* After a reset every pin is an input: outputs are pulled to rest by the rig's resistors, inputs keep their levels. */
static void after_reset(board_t *b) {
  b->was_reset = 0;
  b->depth = 0;
  b->window.resets += 1;
  for (uint32_t i = 0; i < b->line_count; ++i) {
    on_edge(NULL, b->lines[i].rest, &b->lines[i]);
    b->lines[i].irq->value = b->lines[i].rest; /* simavr tells of changes only */
  }
  for (int p = 0; p < PORTS; ++p) {
    avr_ioport_t *port = b->driven[p] ? port_of(b->avr, (char)('A' + p)) : NULL;
    if (port) b->avr->data[port->r_pin] = (uint8_t)((b->avr->data[port->r_pin] & ~b->driven[p]) | (b->level[p] & b->driven[p]));
  }
}

/* Has the timer whose output is on the pin tell of every change of its comparator. */
static void follow_timer(board_t *b, char port, int bit, int role) {
  const avr_ioport_t *p = port_of(b->avr, port);
  for (avr_io_t *io = b->avr->io_port; io; io = io->next) {
    const avr_timer_t *timer = (const avr_timer_t *)io;
    for (int i = 0; i < AVR_TIMER_COMP_COUNT && !strcmp(io->kind, "timer"); ++i)
      if (timer->comp[i].r_ocrh && timer->comp[i].com_pin.reg == p->r_port && timer->comp[i].com_pin.bit == bit)
        b->timer[role] = timer, b->comparator[role] = &timer->comp[i];
  }
  if (!b->comparator[role]) return;
  const avr_io_addr_t registers[] = {b->comparator[role]->r_ocr, b->comparator[role]->com.reg};
  for (int i = 0; i < 2; ++i)
    avr_irq_register_notify(avr_iomem_getirq(b->avr, registers[i], NULL, AVR_IOMEM_IRQ_ALL), on_timer, b);
}

/* ---- the interface */

void board_free(board_t *b) {
  if (b->avr) avr_terminate(b->avr);
  free(b->inputs.at), free(b->to_uart.at), free(b->from_uart.at), free(b->edges.at), free(b);
}

board_t *board_new(const char *elf, uint32_t hz, uint32_t baud) {
  static elf_firmware_t firmware; /* large; read at once and its parts kept by simavr */
  memset(&firmware, 0, sizeof firmware);
  avr_global_logger_set(on_log);
  if (elf_read_firmware(elf, &firmware)) return NULL;
  board_t *b = calloc(1, sizeof *b);
  if (!b) return NULL;
  b->inputs.size = sizeof(input_t), b->edges.size = sizeof(edge_t), b->to_uart.size = b->from_uart.size = 1;
  b->byte_cycles = 11ull * hz / baud;
  b->symbols = firmware.symbol, b->symbol_count = firmware.symbolcount;
  avr_t *avr = b->avr = avr_make_mcu_by_name("atmega2560");
  if (!avr) return board_free(b), NULL;
  avr->custom.data = b;
  avr_init(avr);
  avr->log = LOG_WARNING;
  avr->vcc = avr->avcc = avr->aref = 5000;
  avr_load_firmware(avr, &firmware);
  avr->frequency = hz;
  avr->sleep = no_sleep;
  b->core_reset = avr->reset;
  avr->reset = on_reset;
  for (int i = 0; i < 8; ++i) avr_extint_set_strict_lvl_trig(avr, (uint8_t)i, 0);
  for (char uart = '0'; uart <= '3'; ++uart) {
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(uart), &flags);
  }
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_tx, b);
  for (int i = 0; i < TIMERS; ++i)
    avr_irq_register_notify(avr_iomem_getirq(avr, (avr_io_addr_t)(TIMSK0 + i), NULL, AVR_IOMEM_IRQ_ALL), on_mask, b);
  avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING, on_interrupt, b);
  return b;
}

window_t *board_window(board_t *b) { return &b->window; }

/* Watches an output pin; with a role it drives the plant. Returns the line's number in the trace, or -1. */
int board_line(board_t *b, char port, int bit, int role, int rest, int traced) {
  if (b->line_count == LINES) return -1;
  line_t *line = &b->lines[b->line_count];
  avr_irq_t *irq = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit);
  *line = (line_t){b, irq, b->line_count++, (uint32_t)traced, (uint8_t)role, (uint8_t)rest, (uint8_t)rest};
  b->level_of[role] = (uint8_t)rest;
  if (role == FORWARD || role == REVERSE) follow_timer(b, port, bit, role);
  avr_irq_register_notify(irq, on_edge, line);
  return (int)line->index;
}

void board_trace(board_t *b, uint32_t line, int on) { b->lines[line].traced = (uint32_t)on; }

void board_encoder(board_t *b, int n, char port_a, int bit_a, char port_b, int bit_b) {
  encoder_t *e = &b->encoder[n];
  e->port[0] = (uint8_t)port_a, e->bit[0] = (uint8_t)bit_a, e->port[1] = (uint8_t)port_b, e->bit[1] = (uint8_t)bit_b;
  e->wired = 1;
  for (int i = 0; i < 2; ++i) drive_pin(b, (char)e->port[i], e->bit[i], gray[e->count & 3] >> i & 1);
}

void board_pin(board_t *b, uint64_t cycle, char port, int bit, int level) {
  schedule(b, (input_t){cycle, ON_PIN, (uint8_t)port, (uint8_t)bit, (uint16_t)level});
}

/* A broken or shorted wire: the pin stays at `level` from now on, or is mended with -1 and takes what drives it next. */
void board_stick(board_t *b, char port, int bit, int level) {
  b->stuck[port - 'A'] &= ~(1ull << bit);
  if (level >= 0) {
    drive_pin(b, port, bit, level);
    b->stuck[port - 'A'] |= 1ull << bit;
  }
}

void board_adc(board_t *b, uint64_t cycle, int channel, int millivolts) {
  schedule(b, (input_t){cycle, ON_ADC, 0, (uint8_t)channel, (uint16_t)millivolts});
}

void board_send(board_t *b, const uint8_t *bytes, size_t n) {
  if (b->to_uart.head == b->to_uart.used) {
    const uint64_t now = b->avr->cycle;
    b->next_byte = (b->next_byte > now ? b->next_byte : now) + b->byte_cycles;
  }
  for (size_t i = 0; i < n; ++i) *(uint8_t *)push(&b->to_uart) = bytes[i];
}

size_t board_unsent(const board_t *b) { return b->to_uart.used - b->to_uart.head; }

size_t board_received(const board_t *b) { return b->from_uart.used - b->from_uart.head; }

size_t board_receive(board_t *b, uint8_t *into, size_t room) { return take(&b->from_uart, into, room); }

size_t board_edges(board_t *b, edge_t *into, size_t room) { return take(&b->edges, into, room); }

/* Runs to the cycle `until`. `slice` is how many cycles simavr may run without looking up; 1 is its default. A larger one gives
 * the same edges and bytes, faster: what is scheduled is among simavr's timers, and a slice is cut at the next of them. */
int board_run(board_t *b, uint64_t until, uint32_t slice) {
  avr_t *avr = b->avr;
  uint64_t armed = 0;
  const uint64_t begin = avr->cycle;
  b->motor_sum = 0;
  b->motor_since = begin;
  for (int i = 0; i < ENCODERS; ++i)
    if (b->encoder[i].wired) turn(b, &b->encoder[i], b->window.encoder[i], begin, until);
  while (avr->cycle < until) {
    uint64_t next = until;
    while (b->inputs.head < b->inputs.used) {
      const input_t e = ((input_t *)b->inputs.at)[b->inputs.head];
      if (e.cycle > avr->cycle) {
        if (e.cycle < next) next = e.cycle;
        break;
      }
      ++b->inputs.head;
      deliver(b, &e);
    }
    if (b->inputs.head == b->inputs.used) b->inputs.head = b->inputs.used = 0;
    while (b->to_uart.head < b->to_uart.used && b->next_byte <= avr->cycle) {
      const uint8_t byte = ((uint8_t *)b->to_uart.at)[b->to_uart.head++];
      avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), byte);
      b->next_byte += b->byte_cycles;
    }
    if (b->to_uart.head < b->to_uart.used) next = b->next_byte < next ? b->next_byte : next;
    else if (b->to_uart.used) b->to_uart.head = b->to_uart.used = 0, b->next_byte -= b->byte_cycles;
    if (next != armed) {
      avr_cycle_timer_register(avr, next > avr->cycle ? next - avr->cycle : 1, wake, b);
      armed = next;
    }
    /* simavr's own count is stale by the cycles of an interrupt just entered */
    const uint64_t due = avr->cycle_timers.timer->when;
    const uint64_t left = due > avr->cycle ? due - avr->cycle : 1;
    avr->run_cycle_limit = slice;
    avr->run_cycle_count = left < slice ? left : slice;
    const int state = avr_run(avr);
    if (b->was_reset) after_reset(b), armed = 0;
    if (state == cpu_Done || state == cpu_Crashed) break;
  }
  on_drive(b);
  const double span = (double)(avr->cycle - begin);
  b->window.duty = span > 0 ? b->motor_sum / span : 0;
  return avr->state == cpu_Done || avr->state == cpu_Crashed;
}

uint64_t board_cycle(const board_t *b) { return b->avr->cycle; }

uint32_t board_pc(const board_t *b) { return b->avr->pc; }

uint8_t *board_data(board_t *b) { return b->avr->data; }

uint8_t *board_flash(board_t *b) { return b->avr->flash; }

/* A reset from outside (a button, DTR, the supply), with the cause's flag in MCUSR. */
void board_reset(board_t *b, uint8_t cause) {
  avr_reset(b->avr);
  b->avr->data[MCUSR] = cause;
  after_reset(b);
}

int board_eeprom(board_t *b, int write, uint8_t *bytes, uint16_t offset, uint32_t size) {
  avr_eeprom_desc_t d = {.ee = bytes, .offset = offset, .size = size};
  return avr_ioctl(b->avr, write ? AVR_IOCTL_EEPROM_SET : AVR_IOCTL_EEPROM_GET, &d);
}

/* The address of a symbol of the ELF file (data at 0x800000 and above), or -1. */
int64_t board_symbol(const board_t *b, const char *name) {
  for (uint32_t i = 0; i < b->symbol_count; ++i)
    if (!strcmp(b->symbols[i]->symbol, name)) return b->symbols[i]->addr;
  return -1;
}

void board_vector(const board_t *b, int vector, uint64_t *entries, uint64_t *total, uint64_t *longest) {
  *entries = b->entries[vector], *total = b->total[vector], *longest = b->longest[vector];
}

/* What simavr complained about since the last call. */
const char *board_log(board_t *b) {
  b->log[b->log_used] = 0;
  b->log_used = 0;
  return b->log;
}
