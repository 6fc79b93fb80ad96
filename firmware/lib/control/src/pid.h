// The extended PID of one joint, in integers.
//
//   u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + kv r' + kc sign(r')        e = r - q, w = tip deflection
//
// q' and w' are filtered differences (filter.h, tip.h), T = 1 tick. |u| <= limit, then |u - u of the tick before| <= slew.
// The sum's part of u stays within the limit too, and stands still while limit or slew holds u back and e would push it further.
#pragma once
#include "fixed.h"

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

class Pid {
 public:
  void start(int16_t output) { integral_ = Sum(), output_ = output; }
  int16_t update(const PidGains &gains, const PidSignals &in);
  // Without a controller: brings the output to a wish, within limit and slew.
  int16_t follow(const PidGains &gains, int32_t wish) { return output_ = held(gains, wish); }
  int16_t output() const { return output_; }

 private:
  int16_t held(const PidGains &gains, int32_t wish) const;

  Sum integral_;          // Q32, u
  int16_t output_ = 0;
};

}  // namespace flexura
