#include "motor.h"

#include "declaration.h"
#include "pins.h"

namespace {
constexpr uint8_t kLines = pin::motor_forward::mask | pin::motor_reverse::mask;
}

namespace motor {

void begin() {
  pin::motor_enable::port() &= static_cast<uint8_t>(~(kLines | pin::motor_enable::mask));
  pin::motor_enable::direction() |= kLines | pin::motor_enable::mask;
  TCCR4A = _BV(WGM41);                                             // mode 14: fast PWM up to ICR4, a new OCR4x from the next period on
  TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40);
  ICR4 = flexura::kDutyFull - 1;
}

// A line at rest is disconnected: a compare value of 0 would still give one count of every period.
void drive(int16_t duty) {
  const uint8_t connected = duty > 0 ? _BV(COM4A1) : duty < 0 ? _BV(COM4B1) : 0;
  if (duty > 0) OCR4A = static_cast<uint16_t>(duty - 1);
  if (duty < 0) OCR4B = static_cast<uint16_t>(-duty - 1);
  const uint8_t mode = _BV(WGM41) | connected;
  if (TCCR4A == mode) return;
  TCCR4A = mode;
  PORTH &= static_cast<uint8_t>(~kLines);
}

void enable(bool on) {
  const uint8_t port = PORTH, wanted = on ? port | pin::motor_enable::mask : port & static_cast<uint8_t>(~pin::motor_enable::mask);
  if (port != wanted) PORTH = wanted;
}

}  // namespace motor
