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
constexpr float kVolts = 0.002f;                 // volts in a unit of voltage of a message
constexpr float kRate = 4096.0f;                 // units of u_2 in a microstep per tick
constexpr float kDutyUnits = 16.0f * kDutyFull;  // units of u at the supply's voltage
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

float of(const Config &c, Item item) { return c.values[static_cast<uint8_t>(item)]; }

// The settings of a motor: on a screw in metres, or turning its joint in radians.
struct MotorItems {
  Item counts, low, high, speed, following, stall_speed, runaway, kp, ki, kd, kf, kg, kv, kc;
  Item inertia, damping, observer;
};
const MotorItems kOnScrew = {Item::motor_counts_per_m, Item::position_min_1_m,
                             Item::position_max_1_m,   Item::speed_max_1_m_s,
                             Item::following_max_1_m,  Item::stall_speed_m_s,
                             Item::runaway_distance_m, Item::kp_1_V_m,
                             Item::ki_1_V_m_s,         Item::kd_1_V_s_m,
                             Item::kf_1_V_m,           Item::kg_1_V_s_m,
                             Item::kv_1_V_s_m,         Item::kc_1_V,
                             Item::jo_1_V_s2_m,        Item::bo_1_V_s_m,
                             Item::observer_1_Hz};
const MotorItems kTurning[2] = {
    {Item::motor_1_counts_per_rad, Item::position_min_1_rad, Item::position_max_1_rad,
     Item::speed_max_1_rad_s, Item::following_max_1_rad, Item::stall_speed_1_rad_s,
     Item::runaway_distance_1_rad, Item::kp_1_V_rad, Item::ki_1_V_rad_s, Item::kd_1_V_s_rad,
     Item::kf_1_V_m, Item::kg_1_V_s_m, Item::kv_1_V_s_rad, Item::kc_1_V, Item::jo_1_V_s2_rad,
     Item::bo_1_V_s_rad, Item::observer_1_Hz},
    {Item::motor_2_counts_per_rad, Item::position_min_2_rad, Item::position_max_2_rad,
     Item::speed_max_2_rad_s, Item::following_max_2_rad, Item::stall_speed_2_rad_s,
     Item::runaway_distance_2_rad, Item::kp_2_V_rad, Item::ki_2_V_rad_s, Item::kd_2_V_s_rad,
     Item::kf_2_V_m, Item::kg_2_V_s_m, Item::kv_2_V_s_rad, Item::kc_2_V, Item::jo_2_V_s2_rad,
     Item::bo_2_V_s_rad, Item::observer_2_Hz}};

// As REQUIRE, for a setting that is not known by name.
#define REQUIRE_ITEM(condition, item) \
  if (!(condition)) return static_cast<uint8_t>(item)

// Range, speed and following error of joint j. `unit`: set-point units in the unit of its settings.
uint8_t travel(const Config &c, FixedPointConfig &s, uint8_t j, Item low, Item high, Item speed,
               Item following, float unit, float count) {
  REQUIRE_ITEM(of(c, low) < of(c, high), low);
  // Half of 31 bits: differences of two positions must fit too.
  REQUIRE_ITEM(to_fixed(of(c, low), unit * kQ8 * 2, s.span_low[j]), low);
  REQUIRE_ITEM(to_fixed(of(c, high), unit * kQ8 * 2, s.span_high[j]), high);
  s.span_low[j] /= 2;
  s.span_high[j] /= 2;
  FaultLimits &w = s.limits;
  REQUIRE_ITEM(to_fixed(of(c, low), count, w.travel_low[j]), low);
  REQUIRE_ITEM(to_fixed(of(c, high), count, w.travel_high[j]), high);
  REQUIRE_ITEM(to_fixed(of(c, following), unit * kQ8, w.following[j]), following);
  // and one count of chance
  w.speed[j] = to_16(of(c, speed) * count * kTick * FaultMonitor::kWindow + 1);
  return kAllValid;
}

// Inertia and damping of the nominal joint in the units of ObserverGains (148). `u` is units of
// output per V, `count` counts per m or rad.
uint8_t observer(const Config &c, ObserverGains &o, const MotorItems &item, float u, float count) {
  o = ObserverGains();
  const float frequency = of(c, item.observer);
  if (frequency <= 0) return kAllValid;
  // a / (1 - a) of the filter
  const float period = 2 * kTick;
  const float inertia =
      of(c, item.inertia) / period * (expf(6.2831853f * frequency * period) - 1.0f);
  const float scale = u / count / kTick * kQ8;
  REQUIRE_ITEM(to_fixed(inertia, scale, o.inertia), item.inertia);
  REQUIRE_ITEM(to_fixed(inertia - of(c, item.damping), scale, o.moving), item.damping);
  o.filter = filter(frequency, period);
  return kAllValid;
}

// Gains in the units of PidGains. `u` is units of output per V, `count` counts per m or rad.
uint8_t motor(const Config &c, FixedPointConfig &s, uint8_t j, const MotorItems &item) {
  PidGains &g = s.gains[j];
  FaultLimits &w = s.limits;
  const float u = kDutyUnits / c.supply_V(), count = of(c, item.counts);
  w.drive[j] = Drive::motor;
  g.fine = false;
  REQUIRE_ITEM(gain(of(c, item.kp), u / count * kQ16, g.kp), item.kp);
  REQUIRE_ITEM(to_fixed(of(c, item.ki), u / count * kTick * kQ32, g.ki), item.ki);
  REQUIRE_ITEM(gain(of(c, item.kd), u / count / kTick * kQ8, g.kd), item.kd);
  REQUIRE_ITEM(gain(of(c, item.kf), u / kDeflection * kQ16, g.kf), item.kf);
  REQUIRE_ITEM(gain(of(c, item.kg), u / kDeflection / (2 * kTick) * kQ8, g.kg), item.kg);
  REQUIRE_ITEM(gain(of(c, item.kv), u / count / kTick * kQ8, g.kv), item.kv);
  REQUIRE_ITEM(of(c, item.kc) <= c.supply_V(), item.kc);
  REQUIRE(c.voltage_max_V() <= c.supply_V(), voltage_max_V);
  g.kc = static_cast<int16_t>(of(c, item.kc) * u);
  g.limit = static_cast<int16_t>(c.voltage_max_V() * u);
  g.slew = change(c.voltage_slew_V_s() * kTick * u);
  const uint8_t wrong = observer(c, s.observer[j], item, u, count);
  if (wrong != kAllValid) return wrong;
  w.stall_speed[j] = to_16(of(c, item.stall_speed) * count * kTick * kQ8);
  REQUIRE_ITEM(to_fixed(of(c, item.runaway), count, w.runaway[j]), item.runaway);
  return travel(c, s, j, item.low, item.high, item.speed, item.following, count, count);
}

// The stepper of joint 2. `u` is units of output per rad/s.
uint8_t stepper(const Config &c, FixedPointConfig &s) {
  PidGains &g = s.gains[1];
  FaultLimits &w = s.limits;
  // a gain in rad/s per rad = microsteps/s per microstep
  const float step = c.stepper_steps_per_rad(), u = kRate * kTick;
  const float encoder = s.encoder_2 ? c.stepper_counts_per_rad() : step;
  w.drive[1] = Drive::stepper;
  s.observer[1] = ObserverGains();
  REQUIRE(c.observer_2_Hz() <= 0, observer_2_Hz);  // a joint is where its pulses are
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
  const uint8_t wrong = travel(c, s, 1, Item::position_min_2_rad, Item::position_max_2_rad,
                               Item::speed_max_2_rad_s, Item::following_max_2_rad, step, encoder);
  if (wrong != kAllValid) return wrong;
  REQUIRE(to_fixed(c.lost_step_rad(), step * kQ8, w.lost), lost_step_rad);
  REQUIRE(to_fixed(c.lost_step_rad(), encoder / 4, w.against), lost_step_rad);
  REQUIRE(to_fixed(step / encoder, kQ16, s.ratio), stepper_counts_per_rad);
  REQUIRE(s.ratio < (1L << 24),
          stepper_counts_per_rad);  // 127 counts in a tick times the ratio stay within 32 bits
  s.on_encoder = c.feedback_2() >= 0.5f && s.encoder_2;
  return kAllValid;
}

// Joint 2 is not there: it stays at 0.
void nothing(FixedPointConfig &s) {
  s.gains[1] = PidGains();
  s.observer[1] = ObserverGains();
  s.span_low[1] = s.span_high[1] = 0;
  FaultLimits &w = s.limits;
  w.drive[1] = Drive::none;
  w.travel_low[1] = w.travel_high[1] = w.following[1] = 0;
  w.speed[1] = 0;
}

uint8_t drives(const Config &c, FixedPointConfig &s) {
  const bool turns = c.drive_1() >= 1.5f;
  const uint8_t wrong = motor(c, s, 0, turns ? kTurning[0] : kOnScrew);
  if (wrong != kAllValid) return wrong;
  s.on_encoder = false;
  s.ratio = 0;
  s.limits.lost = s.limits.against = 0;
  s.encoder_2 = c.encoder_2() >= 0.5f && c.drive_2() >= 0.5f;
  if (c.drive_2() >= 1.5f) {
    REQUIRE(s.encoder_2, encoder_2);  // a motor cannot count its steps
    return motor(c, s, 1, kTurning[1]);
  }
  if (c.drive_2() >= 0.5f) return stepper(c, s);
  nothing(s);
  return kAllValid;
}

uint8_t monitoring(const Config &c, FixedPointConfig &s) {
  FaultLimits &w = s.limits;
  w.stall_duty = to_16(c.stall_voltage_V() * kDutyFull / c.supply_V());
  w.stall_ticks = static_cast<uint16_t>(c.stall_time_s() / kTick);
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
  REQUIRE(to_fixed(kDutyUnits / c.supply_V(), kQ16 * kVolts, s.duty), supply_V);
  REQUIRE(to_fixed(c.supply_V() / kDutyUnits, kQ16 / kVolts, s.voltage), supply_V);
  s.supply =
      static_cast<uint16_t>(kReference * c.supply_divider() * kMilli / 1024.0f * 64.0f + 0.5f);
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
  uint8_t wrong = drives(config, fixed);
  if (wrong == kAllValid) wrong = monitoring(config, fixed);
  if (wrong == kAllValid) wrong = sensing(config, fixed);
  return wrong;
}

}  // namespace flexura
