// The firmware's library behind a C interface, for test_lib.py.
#include <cstring>

#include "session.h"

using namespace flexura;

CriticalSection::CriticalSection() : before_(0) {}
CriticalSection::~CriticalSection() { (void)before_; }
InterruptLock::InterruptLock() : before_(0) {}
InterruptLock::~InterruptLock() { (void)before_; }

extern "C" {
uint32_t c_crc(const uint8_t *data, uint16_t size) { return crc32(data, size); }

uint8_t c_encode(uint8_t code, uint16_t sequence, const uint8_t *fields, uint8_t size,
                 uint8_t *frame) {
  return encode(code, sequence, fields, size, frame);
}

// Bytes into a receiver of their own; the payload of the last good frame, and
// its length or -1.
int c_receive(const uint8_t *bytes, uint32_t size, uint8_t *payload) {
  Receiver receiver;
  int length = -1;
  for (uint32_t k = 0; k < size; ++k)
    if (receiver.take(bytes[k])) {
      payload[0] = receiver.code();
      payload[1] = static_cast<uint8_t>(receiver.sequence());
      payload[2] = static_cast<uint8_t>(receiver.sequence() >> 8);
      memcpy(payload + kHeadBytes, receiver.fields(), receiver.size());
      length = receiver.size() + kHeadBytes;
    }
  return length;
}

int c_count(const uint8_t *lines, const uint8_t *which, uint32_t size, int *missed) {
  Quadrature q;
  q.start(0);
  int count = 0;
  for (uint32_t k = 0; k < size; ++k) {
    const uint8_t before = q.count;
    q.update(static_cast<EncoderLine>(which[k]), lines[k]);
    count += static_cast<int8_t>(q.count - before);
  }
  *missed = q.missed;
  return count;
}

// A run of a PID made from a configuration: errors [counts / 256] in, outputs
// [units of u] out.
struct Row {
  PidSignals signals;
  int16_t deflection, deflection_rate;
};

int c_pid(const float *values, uint8_t joint, const Row *rows, uint32_t size, int16_t *outputs) {
  Config config;
  memcpy(config.values, values, sizeof config.values);
  FixedPointConfig fixed;
  const uint8_t wrong = to_fixed_point(config, fixed);
  if (wrong != kAllValid) return wrong;
  Pid pid;
  for (uint32_t k = 0; k < size; ++k) {
    PidSignals signals = rows[k].signals;
    signals.added = added_terms(fixed.gains[joint], rows[k].deflection, rows[k].deflection_rate, 0);
    outputs[k] = pid.update(fixed.gains[joint], signals);
  }
  return kAllValid;
}

// Rates [microstep / 4096 per tick] in; times of all steps [timer counts] and
// their directions out.
int c_steps(const int16_t *rates, uint32_t size, int64_t *at, int8_t *direction) {
  StepGenerator steps;
  StepPlan plan;
  int n = 0;
  for (uint32_t k = 0; k < size; ++k) {
    steps.plan(rates[k], plan);
    for (uint8_t i = 0; i < plan.count; ++i, ++n) {
      at[n] = static_cast<int64_t>(k) * kTickCounts + plan.at[i];
      direction[n] = plan.up ? 1 : -1;
    }
  }
  return n;
}

// A whole board through a closed run: every tick has its own set-point (counts
// / 256, microsteps / 256), encoder counts and reading. Out: the motor's
// voltage [2 mV] and the stepper's rate [microstep/s] as reported. The first
// played tick is an even one.
struct Told {
  int32_t setpoint[2];
  int16_t moved, flex;
};
struct Done {
  int16_t voltage, rate;
};

int c_board(const float *values, const Told *rows, uint32_t size, Done *done) {
  Rig rig;
  Stored stored = {Config(), 1};
  memcpy(stored.config.values, values, sizeof stored.config.values);
  rig.begin(&stored, 0, 1);
  if (rig.state() != State::idle) return 100 + rig.wrong_item();
  Outputs out;
  Inputs &in = rig.inputs();
  uint16_t detail;
  const auto tell = [&](uint8_t code, const void *fields) {
    return static_cast<int>(rig.command(code, static_cast<const uint8_t *>(fields), detail));
  };
  const uint16_t supply = 502;  // 12 V / 4.9 of 5 V
  in = Inputs();
  in.supply = supply;
  in.flex = static_cast<uint16_t>(rows[0].flex);
  rig.tick(out);  // the next one is even
  const Reference here = {rows[0].setpoint[0] / 256, 0, rows[0].setpoint[1] / 256};
  if (tell(Reference::kCode, &here)) return 1;
  const Arm arm = {static_cast<uint8_t>(Mode::position)};
  if (tell(Arm::kCode, &arm)) return 2;
  uint32_t next = 0;
  const auto feed = [&] {
    for (uint8_t n = 0; n < 8 && next < size; ++n, ++next) {
      Setpoints one = {};
      one.first = static_cast<uint16_t>(next);
      one.count = 1;
      one.final = next + 1 == size;
      one.position_1[0] = rows[next].setpoint[0];
      one.position_2[0] = rows[next].setpoint[1];
      if (tell(Setpoints::kCode, &one)) break;
    }
  };
  feed();
  const Start start = {0};
  if (tell(Start::kCode, &start)) return 3;
  int8_t planned = 0;
  for (uint32_t k = 1; k < size; ++k) {
    feed();
    rig.prepare();
    rig.host_spoke();
    in = Inputs();
    in.supply = supply;
    in.flex = static_cast<uint16_t>(rows[k].flex);
    in.moved[0] = static_cast<int8_t>(rows[k].moved);
    in.stepped = planned;
    rig.tick(out);
    planned = static_cast<int8_t>(out.steps.up ? out.steps.count : -out.steps.count);
    if (rig.state() != State::running) return 1000 + static_cast<int>(rig.fault());
    Telemetry report;
    rig.report(report);
    done[k] = {report.voltage, report.rate};
  }
  return 0;
}
}
