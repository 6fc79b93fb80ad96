// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "fixed_point_config.h"

#include <math.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define FLEXURA_IN_FLASH PROGMEM
static float from_flash(const float &value) { return pgm_read_float(&value); }
#else
#define FLEXURA_IN_FLASH
static float from_flash(const float &value) { return value; }
#endif

// Leaves the function with the number of the setting that is wrong.
#define REQUIRE(condition, name) \
  if (!(condition)) return static_cast<uint8_t>(Item::name)

namespace flexura {

namespace {

struct Row {
  float standard, least, greatest;
};
#define ROW(name, standard, least, greatest) {standard, least, greatest},
const Row kRows[] FLEXURA_IN_FLASH = {FLEXURA_CONFIG(ROW)};
#undef ROW
static_assert(sizeof kRows / sizeof kRows[0] == kConfigItems, "one row an item");

constexpr float kTick = 0.001f, kQ8 = 256.0f, kQ16 = 65536.0f, kQ32 = 4294967296.0f;
constexpr float kFull = 1024.0f * kAdcSamples;   // reading at the reference voltage
constexpr float kDeflection = 1e5f;              // units of 10 um in a metre
constexpr float kMilli = 1000.0f;                // mV in a volt
constexpr float kRate = 4096.0f;                 // units of u_2 in a microstep per tick
constexpr float kDutyUnits = 16.0f * kDutyFull;  // units of u_1 at the supply's voltage
constexpr float kReference = 5.0f;               // V at the ADC's full scale

// a = 1 - exp(-2 pi f T) as Q16; nothing for f = 0.
uint16_t filter(float frequency_Hz, float period_s = kTick) {
  if (frequency_Hz <= 0) return 0;
  const float a = 1.0f - expf(-6.2831853f * frequency_Hz * period_s);
  return static_cast<uint16_t>(clamp(a * 65536.0f, 1.0f, 65535.0f));
}

uint16_t reading(float part) { return static_cast<uint16_t>(part * kFull + 0.5f); }

uint16_t supply_reading(float volts, const Config &c) {
  return static_cast<uint16_t>(
      clamp(volts / c.supply_divider() / kReference * 1024.0f, 0.0f, 1024.0f));
}

// A gain in its units, as Accumulator48::add takes it.
bool gain(float value, float scale, int32_t &fixed) {
  return to_fixed(value, scale, fixed) && fixed < (1L << 23) && fixed > -(1L << 23);
}

int16_t change(float u) {
  return static_cast<int16_t>(clamp(u + 0.5f, 1.0f, static_cast<float>(kOutputMax)));
}

int16_t to_16(float value) { return static_cast<int16_t>(clamp(value, -32767.0f, 32767.0f)); }

// u per unit of one joint: all gains in the units of PidGains. `u` is units of output per V or
// rad/s, `count` counts per m or rad.
uint8_t joint_1(const Config &c, PidGains &g) {
  const float u = kDutyUnits / c.supply_V(), count = c.motor_counts_per_m();
  g.fine = false;
  REQUIRE(gain(c.kp_1_V_m(), u / count * kQ16, g.kp), kp_1_V_m);
  REQUIRE(to_fixed(c.ki_1_V_m_s(), u / count * kTick * kQ32, g.ki), ki_1_V_m_s);
  REQUIRE(gain(c.kd_1_V_s_m(), u / count / kTick * kQ8, g.kd), kd_1_V_s_m);
  REQUIRE(gain(c.kf_1_V_m(), u / kDeflection * kQ16, g.kf), kf_1_V_m);
  REQUIRE(gain(c.kg_1_V_s_m(), u / kDeflection / (2 * kTick) * kQ8, g.kg), kg_1_V_s_m);
  REQUIRE(gain(c.kv_1_V_s_m(), u / count / kTick * kQ8, g.kv), kv_1_V_s_m);
  REQUIRE(c.kc_1_V() <= c.supply_V(), kc_1_V);
  REQUIRE(c.voltage_max_V() <= c.supply_V(), voltage_max_V);
  g.kc = static_cast<int16_t>(c.kc_1_V() * u);
  g.limit = static_cast<int16_t>(c.voltage_max_V() * u);
  g.slew = change(c.voltage_slew_V_s() * kTick * u);
  return kAllValid;
}

uint8_t joint_2(const Config &c, PidGains &g) {
  const float step = c.stepper_steps_per_rad(),
              u = kRate * kTick;  // a gain in rad/s per rad = microsteps/s per microstep
  g.fine = true;
  REQUIRE(gain(c.kp_2_1_s(), u / 16 * kQ16, g.kp), kp_2_1_s);
  REQUIRE(to_fixed(c.ki_2_1_s2(), u / 16 * kTick * kQ32, g.ki), ki_2_1_s2);
  REQUIRE(gain(c.kd_2(), kRate * kQ8, g.kd), kd_2);
  REQUIRE(gain(c.kf_2_rad_s_m(), u * step / kDeflection * kQ16, g.kf), kf_2_rad_s_m);
  REQUIRE(gain(c.kg_2_rad_m(), kRate * step / kDeflection / 2 * kQ8, g.kg), kg_2_rad_m);
  REQUIRE(gain(c.kv_2(), kRate * kQ8, g.kv), kv_2);
  g.kc = 0;
  const float rate = c.rate_max_2_rad_s() * step;  // microsteps/s
  REQUIRE(rate <= 4000.5f, rate_max_2_rad_s);
  g.limit = static_cast<int16_t>(clamp(rate * u + 0.5f, 0.0f, static_cast<float>(kOutputMax)));
  g.slew = change(c.acceleration_max_2_rad_s2() * step * kTick * u);
  return kAllValid;
}

uint8_t travel(const Config &c, FixedPointConfig &s) {
  const float count = c.motor_counts_per_m(), step = c.stepper_steps_per_rad(),
              encoder = c.stepper_counts_per_rad();
  REQUIRE(c.position_min_1_m() < c.position_max_1_m(), position_min_1_m);
  REQUIRE(c.position_min_2_rad() < c.position_max_2_rad(), position_min_2_rad);
  // Half of 31 bits: differences of two positions must fit too.
  REQUIRE(to_fixed(c.position_min_1_m(), count * kQ8 * 2, s.span_low[0]), position_min_1_m);
  REQUIRE(to_fixed(c.position_max_1_m(), count * kQ8 * 2, s.span_high[0]), position_max_1_m);
  REQUIRE(to_fixed(c.position_min_2_rad(), step * kQ8 * 2, s.span_low[1]), position_min_2_rad);
  REQUIRE(to_fixed(c.position_max_2_rad(), step * kQ8 * 2, s.span_high[1]), position_max_2_rad);
  for (uint8_t j = 0; j < 2; ++j) {
    s.span_low[j] /= 2;
    s.span_high[j] /= 2;
  }
  FaultLimits &w = s.limits;
  REQUIRE(to_fixed(c.position_min_1_m(), count, w.travel_low[0]), position_min_1_m);
  REQUIRE(to_fixed(c.position_max_1_m(), count, w.travel_high[0]), position_max_1_m);
  REQUIRE(to_fixed(c.position_min_2_rad(), encoder, w.travel_low[1]), position_min_2_rad);
  REQUIRE(to_fixed(c.position_max_2_rad(), encoder, w.travel_high[1]), position_max_2_rad);
  REQUIRE(to_fixed(c.following_max_1_m(), count * kQ8, w.following[0]), following_max_1_m);
  REQUIRE(to_fixed(c.following_max_2_rad(), step * kQ8, w.following[1]), following_max_2_rad);
  w.speed[0] = to_16(c.speed_max_1_m_s() * count * kTick * FaultMonitor::kWindow +
                     1);  // and one count of chance
  w.speed[1] = to_16(c.speed_max_2_rad_s() * encoder * kTick * FaultMonitor::kWindow + 1);
  return kAllValid;
}

uint8_t monitoring(const Config &c, FixedPointConfig &s) {
  FaultLimits &w = s.limits;
  w.stall_duty = to_16(c.stall_voltage_V() * kDutyFull / c.supply_V());
  w.stall_speed = to_16(c.stall_speed_m_s() * c.motor_counts_per_m() * kTick * kQ8);
  w.stall_ticks = static_cast<uint16_t>(c.stall_time_s() / kTick);
  REQUIRE(to_fixed(c.runaway_distance_m(), c.motor_counts_per_m(), w.runaway), runaway_distance_m);
  REQUIRE(to_fixed(c.lost_step_rad(), c.stepper_steps_per_rad() * kQ8, w.lost), lost_step_rad);
  REQUIRE(to_fixed(c.lost_step_rad(), c.stepper_counts_per_rad() / 4, w.against), lost_step_rad);
  w.missed = static_cast<uint16_t>(c.missed_edges_max());
  w.alone = static_cast<uint16_t>(c.one_sided_edges_max());
  REQUIRE(c.flex_min() < c.flex_max(), flex_min);
  w.flex_low = reading(c.flex_min());
  w.flex_high = reading(c.flex_max());
  REQUIRE(c.supply_min_V() < c.supply_max_V(), supply_min_V);
  w.supply_low = supply_reading(c.supply_min_V(), c);
  w.supply_high = supply_reading(c.supply_max_V(), c);
  w.host_ticks = static_cast<uint16_t>(c.host_timeout_s() / kTick);
  return kAllValid;
}

uint8_t sensing(const Config &c, FixedPointConfig &s) {
  const float per_x =
      65536.0f / 8.0f / kFull;  // x as Q16 counts to 8 kFull only: two readings, times four
  s.tip.zero = static_cast<int16_t>(reading(2.0f * c.flex_zero()));
  REQUIRE(to_fixed(c.flex_c1_m(), kDeflection * kQ8 * per_x, s.tip.c1), flex_c1_m);
  REQUIRE(to_fixed(c.flex_c2_m(), kDeflection * kQ8 * per_x * per_x, s.tip.c2), flex_c2_m);
  REQUIRE(to_fixed(c.flex_c3_m(), kDeflection * kQ8 * per_x * per_x * per_x, s.tip.c3), flex_c3_m);
  s.tip.filter = filter(c.deflection_Hz(), 2 * kTick);
  s.velocity_filter = filter(c.derivative_Hz());
  s.setpoint_filter[0] = filter(c.setpoint_1_Hz());
  s.setpoint_filter[1] = filter(c.setpoint_2_Hz());
  REQUIRE(to_fixed(kDutyUnits / c.supply_V(), kQ16 / kMilli, s.duty), supply_V);
  REQUIRE(to_fixed(c.supply_V() / kDutyUnits, kMilli * kQ16, s.voltage), supply_V);
  REQUIRE(to_fixed(c.stepper_steps_per_rad() / c.stepper_counts_per_rad(), kQ16, s.ratio),
          stepper_counts_per_rad);
  REQUIRE(s.ratio < (1L << 24),
          stepper_counts_per_rad);  // 127 counts in a tick times the ratio stay within 32 bits
  s.supply =
      static_cast<uint16_t>(kReference * c.supply_divider() * kMilli / 1024.0f * 64.0f + 0.5f);
  s.on_encoder = c.feedback_2() >= 0.5f;
  return kAllValid;
}

}  // namespace

Config default_config() {
  Config config;
  for (uint8_t i = 0; i < kConfigItems; ++i) config.values[i] = from_flash(kRows[i].standard);
  return config;
}

bool in_range(uint8_t item, float value) {
  return item < kConfigItems && value >= from_flash(kRows[item].least) &&
         value <= from_flash(kRows[item].greatest);
}

uint8_t to_fixed_point(const Config &config, FixedPointConfig &fixed) {
  for (uint8_t i = 0; i < kConfigItems; ++i)
    if (!in_range(i, config.values[i])) return i;
  uint8_t wrong = joint_1(config, fixed.gains[0]);
  if (wrong == kAllValid) wrong = joint_2(config, fixed.gains[1]);
  if (wrong == kAllValid) wrong = travel(config, fixed);
  if (wrong == kAllValid) wrong = monitoring(config, fixed);
  if (wrong == kAllValid) wrong = sensing(config, fixed);
  return wrong;
}

}  // namespace flexura
