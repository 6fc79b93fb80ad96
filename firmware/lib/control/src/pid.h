// The extended PID of one joint (law.h) in integers.
#pragma once
#include "fixed.h"
#include "law.h"

namespace flexura {

// u is in 1/16 PWM counts for joint 1, in 1/4096 microsteps per tick for joint 2: 16 bits hold it, and the sum of two of it.
// "count" stands for either joint's unit of position.
constexpr int16_t kOutputMost = 16383;

struct PidGains {
  bool fine = false;  // errors are taken in 1/16 counts, and end at 2047 counts; else in counts, and end at 32767
  int32_t kp = 0;     // Q16, u per unit of error
  int32_t ki = 0;     // Q32, u per unit of error and tick
  int32_t kd = 0;     // Q8, u per (count / tick)
  int32_t kf = 0;     // Q16, u per 10 um
  int32_t kg = 0;     // Q8, u per (10 um / two ticks)
  int32_t kv = 0;     // Q8, u per (count / tick)
  int16_t kc = 0;     // u
  int16_t limit = 0;  // u, at most kOutputMost
  int16_t slew = 0;   // u per tick, the same
};

struct PidSignals {
  int32_t error;            // counts / 256
  int16_t rate;             // q', counts / 256 per tick
  int16_t setpoint_rate;    // r', the same
  int32_t tip;              // what the strip adds to u, Q16: tip_term(), renewed every second tick
};

// kf w + kg w', Q16 of u; deflection [10 um], its rate [10 um / 256 in two ticks].
int32_t tip_term(const PidGains &gains, int16_t deflection, int16_t rate);

// The board's numbers. The law's sum is Q32 of u, its parts Q16.
struct Integers {
  using Output = int16_t;
  using Wish = int32_t;
  using Gains = PidGains;
  using Signals = PidSignals;
  using Sum = flexura::Sum;

  static int16_t error(const PidGains &gains, const PidSignals &in) { return gains.fine ? flexura::narrow(in.error >> 4) : flexura::narrow(in.error >> 8); }
  static int16_t difference(int16_t a, int16_t b) { return flexura::narrow(static_cast<int32_t>(a) - b); }
  static int16_t narrow(int32_t wish) { return flexura::narrow(wish); }
};

extern template class Law<Integers>;
using Pid = Law<Integers>;

}  // namespace flexura
