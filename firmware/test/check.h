// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// As much of a test framework as is needed, alike on the host and on the AVR. Prints Unity's lines.
#pragma once
#include <stdint.h>
#include <stdio.h>

#ifdef ARDUINO
#include <Arduino.h>
#include <avr/sleep.h>
inline void say(const char *file, long line, const char *name, const char *rest) {
  char text[120];
  snprintf_P(text, sizeof text, PSTR("%s:%ld:%s:%s"), file, line, name, rest);
  Serial.println(text);
}
inline void report_number(const char *what, long value) {
  char text[80];
  snprintf_P(text, sizeof text, PSTR("%s: %ld"), what, value);
  Serial.println(text);
}
inline void say_end(int run, int failed) {
  char text[60];
  snprintf_P(text, sizeof text, PSTR("%d Tests %d Failures 0 Ignored"), run, failed);
  Serial.println(text);
}
#else
inline void say(const char *file, long line, const char *name, const char *rest) {
  printf("%s:%ld:%s:%s\n", file, line, name, rest);
}
inline void say_end(int run, int failed) {
  printf("%d Tests %d Failures 0 Ignored\n", run, failed);
}
#endif

static int checks_run, checks_failed;
static long check_line;  // of the first failure in this test, or 0

#define CHECK(condition)                                    \
  do {                                                      \
    if (!check_line && !(condition)) check_line = __LINE__; \
  } while (0)

// Through a pointer: inlined into one function, what all tests keep would not fit the AVR's stack.
#define RUN(test)                                                                                  \
  do {                                                                                             \
    void (*volatile run)() = test;                                                                 \
    check_line = 0;                                                                                \
    ++checks_run;                                                                                  \
    run();                                                                                         \
    if (check_line) ++checks_failed;                                                               \
    say("test_main.cpp", check_line ? check_line : __LINE__, #test, check_line ? "FAIL" : "PASS"); \
  } while (0)

#ifdef ARDUINO
#define CHECK_MAIN(body)                     \
  void setup() {                             \
    Serial.begin(115200);                    \
    body;                                    \
    say_end(checks_run, checks_failed);      \
    Serial.flush();                          \
    cli();                                   \
    sleep_enable();                          \
    sleep_cpu(); /* an emulator ends here */ \
  }                                          \
  void loop() {}
#else
#define CHECK_MAIN(body)                \
  int main() {                          \
    body;                               \
    say_end(checks_run, checks_failed); \
    return checks_failed;               \
  }
#endif
