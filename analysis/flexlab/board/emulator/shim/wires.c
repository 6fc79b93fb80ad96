/* The wires between firmware and plant: pins, encoders and ADC on the way in; drivers' inputs and
 * steps on the way out. */
#include <math.h>

#include "avr_adc.h"
#include "board.h"

void schedule(board_t *b, input_t e) {
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

void deliver(board_t *b, const input_t *e) {
  if (e->kind == ON_PIN)
    drive_pin(b, (char)e->unit, e->n, e->value);
  else
    avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_ADC_GETIRQ, e->n), e->value);
}

static const uint8_t gray[4] = {0, 1, 3, 2}; /* of a count's last two bits; bit 0: A, bit 1: B */

/* A shaft that moves evenly from its last position to `position` between two cycles; A leads B
 * upwards. */
void turn(board_t *b, encoder_t *encoder, double position, uint64_t begin, uint64_t end) {
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
      schedule(b, (input_t){begin + (uint64_t)((crossed - encoder->position) * scale), ON_PIN,
                            encoder->port[which], encoder->bit[which], (now >> which) & 1});
    }
  }
  encoder->position = position;
}

/* ---- what the firmware does */

static int is_pwm(int role) {
  return role == FORWARD || role == REVERSE || role == FORWARD_2 || role == REVERSE_2;
}

static int always_on(const board_t *b, int role) {
  const avr_timer_comp_t *comparator = b->comparator[role];
  if (!comparator || b->cut[role] || avr_regbit_get(b->avr, comparator->com) != avr_timer_com_clear)
    return 0;
  const uint8_t *data = b->avr->data;
  const avr_timer_t *timer = b->timer[role];
  return (data[comparator->r_ocr] | data[comparator->r_ocrh] << 8) >=
         (data[timer->r_icr] | data[timer->r_icrh] << 8);
}

/* A write to a port has simavr believe that the PWM outputs on it are low, in the middle of their
 * pulse. */
static int still_high(const board_t *b, int role) {
  const avr_timer_comp_t *comparator = b->comparator[role];
  if (!comparator || avr_regbit_get(b->avr, comparator->com) != avr_timer_com_clear) return 0;
  return b->avr->cycle - b->timer[role]->tov_base < comparator->comp_cycles;
}

/* The drivers' inputs changed: what they did until now goes into the sums. */
void on_drive(board_t *b) {
  const uint64_t now = b->avr->cycle;
  window_t *w = &b->window;
  if (w->stepper_on != 0) w->step_cycle = (double)now;
  w->stepper_on = !b->level_of[STEP_DISABLE];
  for (int m = 0; m < MOTORS; ++m) {
    const int roles = m * (FORWARD_2 - FORWARD);
    b->motor_sum[m] += b->motor[m] * (double)(now - b->motor_since[m]);
    b->motor_since[m] = now;
    if (w->motor_on[m] != 0) w->driven_cycle = (double)now;
    w->motor_on[m] = b->level_of[ENABLE + roles];
    const int forward = b->level_of[FORWARD + roles] || always_on(b, FORWARD + roles),
              reverse = b->level_of[REVERSE + roles] || always_on(b, REVERSE + roles);
    b->motor[m] = b->level_of[ENABLE + roles] ? forward - reverse : 0;
  }
}

static void on_edge(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  line_t *line = param;
  board_t *b = line->board;
  const uint8_t level = line->cut ? line->rest : value & 1;
  if (level == line->level) return;
  if (is_pwm(line->role) && !level && !line->cut && still_high(b, line->role)) {
    line->irq->flags |= IRQ_FLAG_INIT; /* simavr tells of the next change, which is none for it */
    return;
  }
  if (line->role == STEP && b->comparator[STEP]) {
    const uint8_t mode = avr_regbit_get(b->avr, b->comparator[STEP]->com);
    if (mode == (level ? avr_timer_com_clear : avr_timer_com_set)) { /* not what that mode can do */
      b->unsettled = 1;
      return;
    }
  }
  line->level = level;
  if (line->traced) *(edge_t *)push(&b->edges) = (edge_t){b->avr->cycle, line->index, level};
  b->level_of[line->role] = level;
  if (line->role == STEP && level && b->window.stepper_on != 0) {
    const double step = b->level_of[STEP_UP] ? 1 : -1;
    b->window.steps += step;
    b->steps_late += step * (double)(b->avr->cycle - b->begin);
  } else if (line->role)
    on_drive(b);
}

static void on_timer(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value, on_drive(param);
}

/* Has the timer whose output is on the pin tell of every change of its comparator. */
static void follow_timer(board_t *b, char port, int bit, int role) {
  const avr_ioport_t *p = port_of(b->avr, port);
  for (avr_io_t *io = b->avr->io_port; io; io = io->next) {
    const avr_timer_t *timer = (const avr_timer_t *)io;
    for (int i = 0; i < AVR_TIMER_COMP_COUNT && !strcmp(io->kind, "timer"); ++i)
      if (timer->comp[i].r_ocrh && timer->comp[i].com_pin.reg == p->r_port &&
          timer->comp[i].com_pin.bit == bit)
        b->timer[role] = timer, b->comparator[role] = &timer->comp[i];
  }
  if (!b->comparator[role]) return;
  const avr_io_addr_t registers[] = {b->comparator[role]->r_ocr, b->comparator[role]->com.reg};
  for (int i = 0; i < 2; ++i)
    avr_irq_register_notify(avr_iomem_getirq(b->avr, registers[i], NULL, AVR_IOMEM_IRQ_ALL),
                            on_timer, b);
}

/* Has simavr believe what the lines are. */
void settle(board_t *b) {
  b->unsettled = 0;
  for (uint32_t i = 0; i < b->line_count; ++i) /* simavr tells of changes only */
    if (!b->lines[i].cut) b->lines[i].irq->value = b->lines[i].level;
}

/* After a reset every pin is an input: outputs are pulled to rest by the rig's resistors, inputs
 * keep their levels. */
void rest(board_t *b) {
  for (uint32_t i = 0; i < b->line_count; ++i) on_edge(NULL, b->lines[i].rest, &b->lines[i]);
  settle(b);
  for (int p = 0; p < PORTS; ++p) {
    avr_ioport_t *port = b->driven[p] ? port_of(b->avr, (char)('A' + p)) : NULL;
    if (port)
      b->avr->data[port->r_pin] =
          (uint8_t)((b->avr->data[port->r_pin] & ~b->driven[p]) | (b->level[p] & b->driven[p]));
  }
}

/* ---- the interface */

/* Watches an output pin; with a role it drives the plant. Returns the line's number in the trace,
 * or -1. */
int board_line(board_t *b, char port, int bit, int role, int rest, int traced) {
  if (b->line_count == LINES) return -1;
  line_t *line = &b->lines[b->line_count];
  avr_irq_t *irq = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit);
  *line = (line_t){.board = b,
                   .irq = irq,
                   .index = b->line_count++,
                   .traced = (uint32_t)traced,
                   .role = (uint8_t)role,
                   .rest = (uint8_t)rest,
                   .level = (uint8_t)rest};
  b->level_of[role] = (uint8_t)rest;
  if (is_pwm(role) || role == STEP) follow_timer(b, port, bit, role);
  avr_irq_register_notify(irq, on_edge, line);
  return (int)line->index;
}

/* Breaks the wire of a line, or mends it: then it has the level that the pin's output has. */
void board_cut(board_t *b, uint32_t n, int broken) {
  line_t *line = &b->lines[n];
  line->cut = (uint8_t)(broken != 0);
  if (line->role) b->cut[line->role] = line->cut;
  on_edge(NULL, line->irq->value & 1, line);
  if (line->role) on_drive(b);
}

void board_trace(board_t *b, uint32_t line, int on) { b->lines[line].traced = (uint32_t)on; }

void board_encoder(board_t *b, int n, char port_a, int bit_a, char port_b, int bit_b) {
  encoder_t *e = &b->encoder[n];
  e->port[0] = (uint8_t)port_a, e->bit[0] = (uint8_t)bit_a, e->port[1] = (uint8_t)port_b,
  e->bit[1] = (uint8_t)bit_b;
  e->wired = 1;
  for (int i = 0; i < 2; ++i)
    drive_pin(b, (char)e->port[i], e->bit[i], gray[e->count & 3] >> i & 1);
}

/* A broken or shorted wire: the pin stays at `level` from now on, or is mended with -1 and takes
 * what drives it next. */
void board_stick(board_t *b, char port, int bit, int level) {
  b->stuck[port - 'A'] &= ~(1ull << bit);
  if (level >= 0) {
    drive_pin(b, port, bit, level);
    b->stuck[port - 'A'] |= 1ull << bit;
  }
}
