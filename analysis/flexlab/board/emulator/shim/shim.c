/* An ATmega2560 with its wires, stepped in lockstep with a plant: a flat C interface to simavr for
 * ctypes.
 *
 * The plant sees averages over a window of cycles (motor duty, steps); the firmware sees every edge
 * at its own cycle. All that crosses this border is the block `window_t`, plain C functions for
 * what is rare, and two byte streams.
 *
 * Written for simavr 1.6. Worked around here:
 *   - its UART sleeps on the host while firmware polls it, and prints: flags cleared;
 *   - its sleep() follows the wall clock: replaced;
 *   - a pull-up overwrites a driven input at the next write to that port:
 * AVR_IOCTL_IOPORT_SET_EXTERNAL;
 *   - a reset forgets the levels of input pins: written again;
 *   - an INTn pin that is low before its edge is chosen is polled every cycle: strict level trigger
 * off;
 *   - fast PWM with OCRnx at TOP, which is always on, shows no level at the pin: read from the
 * registers;
 *   - a timer's interrupt that falls due while it is masked is forgotten: raised when it is
 * unmasked;
 *   - a watchdog whose interrupt nobody serves never resets: it does with its next time-out;
 *   - a write to a port ends the PWM pulses of its pins: ignored;
 *   - without PWM, a compare pin that is to be set is cleared when the timer overflows or another
 * OCRnx is written: ignored;
 *   - a byte of the UART takes 11 bit times, not 10 (left as it is: slower than the hardware).
 */
#include <stdarg.h>
#include <stdio.h>

#include "avr_eeprom.h"
#include "avr_extint.h"
#include "avr_uart.h"
#include "board.h"

/* ---- simavr's hooks */

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
    b->nested[b->depth] = 0;
    b->stack[b->depth++] = value;
    b->entered[value] = now;
    ++b->entries[value], ++b->entries[0];
  } else if (b->depth) {
    const uint32_t vector = b->stack[--b->depth];
    const uint64_t took = now - b->entered[vector];
    if (took > b->longest[vector]) b->longest[vector] = took;
    if (took - b->nested[b->depth] > b->own[vector]) b->own[vector] = took - b->nested[b->depth];
    if (b->depth) b->nested[b->depth - 1] += took;
    b->total[vector] += took;
    if (!b->depth) b->total[0] += now - b->entered[0];
  }
}

static avr_cycle_count_t second_bite(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr, (void)when;
  ((board_t *)param)->bitten = 1;
  return 0;
}

/* The watchdog's interrupt is pending, or no longer. */
static void on_bite(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  board_t *b = param;
  if (value && avr_regbit_get(b->avr, b->watchdog->wde))
    avr_cycle_timer_register(b->avr, b->watchdog->cycle_count, second_bite, b);
  else
    avr_cycle_timer_cancel(b->avr, second_bite, b);
}

/* A timer's mask was written: what fell due behind it and is let through now is due now, as the
 * flag in TIFRn says. */
static void on_mask(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value;
  board_t *b = param;
  for (int i = 0; i < b->avr->interrupts.vector_count; ++i) {
    avr_int_vector_t *vector = b->avr->interrupts.vector[i];
    if (vector->enable.reg < TIMSK0 || vector->enable.reg >= TIMSK0 + TIMERS || vector->pending)
      continue;
    if (avr_regbit_get(b->avr, vector->enable) && avr_regbit_get(b->avr, vector->raised))
      avr_raise_interrupt(b->avr, vector);
  }
}

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

static avr_cycle_count_t wake(avr_t *avr, avr_cycle_count_t when, void *param) {
  return (void)avr, (void)when, (void)param, 0;
}

static void after_reset(board_t *b) {
  b->was_reset = b->bitten = 0;
  b->depth = 0;
  b->window.resets += 1;
  rest(b);
}

/* ---- the interface */

void board_free(board_t *b) {
  if (b->avr) avr_terminate(b->avr);
  free(b->inputs.at), free(b->to_uart.at), free(b->from_uart.at), free(b->edges.at), free(b);
}

/* `flash`: what the flash holds from address 0 on; the rest is erased. */
board_t *board_new(const uint8_t *flash, uint32_t size, uint32_t hz, uint32_t baud) {
  avr_global_logger_set(on_log);
  board_t *b = calloc(1, sizeof *b);
  if (!b) return NULL;
  b->inputs.size = sizeof(input_t), b->edges.size = sizeof(edge_t),
  b->to_uart.size = b->from_uart.size = 1;
  b->byte_cycles = 11ull * hz / baud;
  avr_t *avr = b->avr = avr_make_mcu_by_name("atmega2560");
  if (!avr) return board_free(b), NULL;
  avr->custom.data = b;
  avr_init(avr);
  avr->log = LOG_WARNING;
  avr->vcc = avr->avcc = avr->aref = 5000;
  avr_loadcode(avr, (uint8_t *)flash, size, 0);
  avr->codeend = size;
  avr->frequency = hz;
  avr->sleep = no_sleep;
  b->core_reset = avr->reset;
  avr->reset = on_reset;
  for (int i = 0; i < 8; ++i) avr_extint_set_strict_lvl_trig(avr, (uint8_t)i, 0);
  for (char uart = '0'; uart <= '3'; ++uart) {
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(uart), &flags);
  }
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_tx,
                          b);
  for (int i = 0; i < TIMERS; ++i)
    avr_irq_register_notify(
        avr_iomem_getirq(avr, (avr_io_addr_t)(TIMSK0 + i), NULL, AVR_IOMEM_IRQ_ALL), on_mask, b);
  for (avr_io_t *io = avr->io_port; io; io = io->next)
    if (!strcmp(io->kind, "watchdog")) b->watchdog = (avr_watchdog_t *)io;
  avr_irq_register_notify(b->watchdog->watchdog.irq + AVR_INT_IRQ_PENDING, on_bite, b);
  avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
                          on_interrupt, b);
  return b;
}

window_t *board_window(board_t *b) { return &b->window; }

void board_pin(board_t *b, uint64_t cycle, char port, int bit, int level) {
  schedule(b, (input_t){cycle, ON_PIN, (uint8_t)port, (uint8_t)bit, (uint16_t)level});
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

size_t board_receive(board_t *b, uint8_t *into, size_t room) {
  return take(&b->from_uart, into, room);
}

size_t board_edges(board_t *b, edge_t *into, size_t room) { return take(&b->edges, into, room); }

/* Runs to the cycle `until`. `slice` is how many cycles simavr may run without looking up; 1 is its
 * default. A larger one gives the same edges and bytes, faster: what is scheduled is among simavr's
 * timers, and a slice is cut at the next of them. */
int board_run(board_t *b, uint64_t until, uint32_t slice) {
  avr_t *avr = b->avr;
  uint64_t armed = 0;
  const uint64_t begin = b->begin = avr->cycle;
  b->steps_late = 0;
  for (int m = 0; m < MOTORS; ++m) b->motor_sum[m] = 0, b->motor_since[m] = begin;
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
    if (b->to_uart.head < b->to_uart.used)
      next = b->next_byte < next ? b->next_byte : next;
    else if (b->to_uart.used)
      b->to_uart.head = b->to_uart.used = 0, b->next_byte -= b->byte_cycles;
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
    if (b->unsettled) settle(b);
    if (b->bitten) avr_reset(avr), avr->data[MCUSR] = WATCHDOG_RESET;
    if (b->was_reset) after_reset(b), armed = 0; /* simavr's timers are gone */
    if (state == cpu_Done || state == cpu_Crashed) break;
  }
  on_drive(b);
  const double span = (double)(avr->cycle - begin);
  for (int m = 0; m < MOTORS; ++m) b->window.duty[m] = span > 0 ? b->motor_sum[m] / span : 0;
  b->window.steps_mean = b->window.steps - (span > 0 ? b->steps_late / span : 0);
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

/* into: entries, cycles in all, cycles of the longest, cycles of the longest without those that
 * interrupted it. */
void board_vector(const board_t *b, int vector, uint64_t into[4]) {
  into[0] = b->entries[vector], into[1] = b->total[vector], into[2] = b->longest[vector],
  into[3] = b->own[vector];
}

/* What simavr complained about since the last call. */
const char *board_log(board_t *b) {
  b->log[b->log_used] = 0;
  b->log_used = 0;
  return b->log;
}
