// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "frame.h"

#include <string.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#else
#define PROGMEM
static uint32_t pgm_read_dword(const uint32_t *value) { return *value; }
#endif

namespace flexura {

namespace {
// What eight steps of the polynomial's division make of one byte.
constexpr uint32_t step(uint32_t crc) { return crc & 1 ? crc >> 1 ^ 0xEDB88320ul : crc >> 1; }
constexpr uint32_t steps(uint32_t crc) {
  return step(step(step(step(step(step(step(step(crc))))))));
}
#define FOUR(n) steps(n), steps(n + 1), steps(n + 2), steps(n + 3)
#define SIXTEEN(n) FOUR(n), FOUR(n + 4), FOUR(n + 8), FOUR(n + 12)
#define SIXTY_FOUR(n) SIXTEEN(n), SIXTEEN(n + 16), SIXTEEN(n + 32), SIXTEEN(n + 48)
const uint32_t kSteps[256] PROGMEM = {SIXTY_FOUR(0), SIXTY_FOUR(64), SIXTY_FOUR(128),
                                      SIXTY_FOUR(192)};
#undef FOUR
#undef SIXTEEN
#undef SIXTY_FOUR
}  // namespace

// Not inlined: its unrolled loop in every place that asks for it took 10 KB.
__attribute__((noinline)) uint32_t crc32(const uint8_t *data, uint16_t size, uint32_t crc) {
  crc = ~crc;
  while (size--) crc = crc >> 8 ^ pgm_read_dword(&kSteps[static_cast<uint8_t>(crc) ^ *data++]);
  return ~crc;
}

uint8_t encode(uint8_t code, uint16_t sequence, const void *fields, uint8_t size, uint8_t *frame) {
  const uint8_t head[kHeadBytes] = {code, static_cast<uint8_t>(sequence),
                                    static_cast<uint8_t>(sequence >> 8)};
  const uint8_t *bytes = static_cast<const uint8_t *>(fields);
  const uint32_t crc = crc32(bytes, size, crc32(head, kHeadBytes));
  uint8_t tail[kCrcBytes];
  memcpy(tail, &crc, kCrcBytes);

  uint8_t at = 1, block = 0;
  const uint8_t total = static_cast<uint8_t>(kHeadBytes + size + kCrcBytes);
  for (uint8_t i = 0; i < total; ++i) {
    const uint8_t byte = i < kHeadBytes          ? head[i]
                         : i < kHeadBytes + size ? bytes[i - kHeadBytes]
                                                 : tail[i - kHeadBytes - size];
    if (byte) {
      frame[at++] = byte;
    } else {
      frame[block] = static_cast<uint8_t>(at - block);
      block = at++;
    }
  }
  frame[block] = static_cast<uint8_t>(at - block);
  frame[at++] = 0;
  return at;
}

void Receiver::append(uint8_t byte) {
  if (used_ < sizeof payload_) {
    payload_[used_++] = byte;
  } else {
    bad_ = true;
  }
}

bool Receiver::take(uint8_t byte) {
  if (byte == 0) return finish();
  if (left_) {
    append(byte);
    --left_;
    return false;
  }
  if (zero_due_) append(0);
  left_ = static_cast<uint8_t>(byte - 1);
  zero_due_ = byte != 0xFF;
  return false;
}

bool Receiver::finish() {
  const uint8_t used = used_;
  const bool whole = !bad_ && left_ == 0 && used >= kHeadBytes + kCrcBytes;
  used_ = left_ = 0;
  zero_due_ = bad_ = false;
  if (!whole) return false;
  length_ = static_cast<uint8_t>(used - kCrcBytes);
  uint32_t crc;
  memcpy(&crc, payload_ + length_, kCrcBytes);
  return crc32(payload_, length_) == crc;
}

}  // namespace flexura
