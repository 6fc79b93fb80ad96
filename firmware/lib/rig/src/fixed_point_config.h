// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// What the control interrupt computes with, made from the configuration in SI units.
#pragma once
#include "disturbance_observer.h"
#include "fault_monitor.h"
#include "flex_sensor.h"
#include "pid.h"

namespace flexura {

struct FixedPointConfig {
  PidGains gains[2];
  ObserverGains observer[2];
  FlexSensorScale tip;
  FaultLimits limits;
  uint16_t velocity_filter, setpoint_filter[2];  // Q16
  int32_t duty;                                  // Q16, units of u (1/16 PWM count) per 2 mV
  int32_t voltage;                               // Q16, 2 mV in a unit of u
  int32_t ratio;                      // Q16, microsteps per count of the encoder of joint 2
  int32_t span_low[2], span_high[2];  // travel of the set-points: counts / 256, microsteps / 256
  uint16_t supply;                    // mV per 64 readings of the supply
  bool on_encoder;                    // a stepper is controlled on its encoder
  bool encoder_2;                     // joint 2 has an encoder
};

// What outlives a reset.
struct Stored {
  Config config;
  uint32_t proven;  // hash of the firmware with which the emergency stop was proven, or 0
};

constexpr uint8_t kAllValid = 255;

// Fills `fixed`; returns the number of an item that is outside its range, contradicts another or
// leaves no computable number, or kAllValid. Takes about a millisecond: not for the interrupt.
uint8_t to_fixed_point(const Config &config, FixedPointConfig &fixed);

// Safe defaults, and the range of one item.
Config default_config();
bool in_range(uint8_t item, float value);

}  // namespace flexura
