// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// A rig on the bench of the unit tests: it comes up, is ticked, armed and run.
#pragma once
#include <string.h>

#include "check.h"
#include "session.h"

using namespace flexura;

// What an interrupt does just before interrupts are shut for the `locks_until`-th time from now on.
static void (*interrupt)();
static uint8_t locks_until;
static void lock() {
  if (!interrupt || locks_until-- > 0) return;
  void (*const due)() = interrupt;
  interrupt = nullptr;
  due();
}

CriticalSection::CriticalSection() : before_(0) { lock(); }
CriticalSection::~CriticalSection() { (void)before_; }
InterruptLock::InterruptLock() : before_(0) { lock(); }
InterruptLock::~InterruptLock() { (void)before_; }

#define ITEM(name) static_cast<uint8_t>(Item::name)

static Rig rig;
static const uint32_t kFirmware = 0x12345678;
static const Build kBuild = {{0, 1, 0}, {5, 4, 0}, 1, 77};
static Outputs out;

inline Result ask(uint8_t code, const void *fields = nullptr) {
  uint16_t detail;
  return rig.command(code, static_cast<const uint8_t *>(fields), detail);
}

// Never inlined: a few rigs that are made on the stack of one function do not fit the AVR's memory.
__attribute__((noinline)) static void fresh_rig() { rig = Rig(); }

// A board that comes up with these settings, its emergency stop proven.
inline void begin(const Config &config, uint8_t reset = 1, uint32_t proven = kFirmware) {
  fresh_rig();
  out = Outputs();
  const Stored stored = {config, proven};
  rig.begin(&stored, reset, kFirmware);
}

inline void tick(uint16_t times = 1) {
  while (times--) {
    Inputs &in = rig.inputs();
    in.moved[0] = in.moved[1] = 0;
    in.stepped =
        static_cast<int8_t>(out.on ? (out.steps.up ? out.steps.count : -out.steps.count) : 0);
    in.edges[0][0] = in.edges[0][1] = in.edges[1][0] = in.edges[1][1] = 0;
    rig.prepare();
    rig.tick(out);
  }
}

// The same, after a tick in which all is well.
inline void begin_with(const Config &config, uint32_t proven = kFirmware) {
  begin(config, 1, proven);
  Inputs &in = rig.inputs();
  memset(&in, 0, sizeof in);
  in.flex = 3500;
  in.supply = 500;
  tick();
}

inline void healthy() {
  Config config = default_config();
  config.lost_step_rad() = 10;  // the encoder of joint 2 stands still in these tests
  begin_with(config);
}

inline void arm(Mode mode) {
  healthy();
  const Reference reference = {0, 0, 0};
  const Arm arm = {static_cast<uint8_t>(mode)};
  CHECK(ask(Arm::kCode, &arm) == Result::not_referenced);
  CHECK(ask(Reference::kCode, &reference) == Result::ok);
  CHECK(ask(Arm::kCode, &arm) == Result::ok && rig.state() == State::armed);
}

inline void run_open_loop(int16_t mV, int16_t rate, bool final = false) {
  arm(Mode::open_loop);
  Drives drives = {};
  drives.count = 8;
  drives.final = final;
  for (uint8_t k = 0; k < 8; ++k) {
    drives.voltage[k] = mV / 2;
    drives.rate[k] = rate;
  }
  CHECK(ask(Drives::kCode, &drives) == Result::ok);
  const Start start = {6};
  CHECK(ask(Start::kCode, &start) == Result::ok && rig.state() == State::running);
}
