// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "frame.h"

namespace flexura {

uint16_t crc16(const uint8_t *data, uint16_t size, uint16_t crc) {
  while (size--) {
    uint8_t x = static_cast<uint8_t>((crc >> 8) ^ *data++);
    x = static_cast<uint8_t>(x ^ x >> 4);
    crc = static_cast<uint16_t>((crc << 8) ^ (static_cast<uint16_t>(x) << 12) ^
                                (static_cast<uint16_t>(x) << 5) ^ x);
  }
  return crc;
}

uint8_t encode(uint8_t code, uint16_t sequence, const void *fields, uint8_t size, uint8_t *frame) {
  const uint8_t head[kHeadBytes] = {code, static_cast<uint8_t>(sequence),
                                    static_cast<uint8_t>(sequence >> 8)};
  const uint8_t *bytes = static_cast<const uint8_t *>(fields);
  const uint16_t crc = crc16(bytes, size, crc16(head, kHeadBytes));
  const uint8_t tail[2] = {static_cast<uint8_t>(crc), static_cast<uint8_t>(crc >> 8)};

  uint8_t at = 1, block = 0;
  const uint8_t total = static_cast<uint8_t>(kHeadBytes + size + 2);
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
  const bool whole = !bad_ && left_ == 0 && used >= kHeadBytes + 2;
  used_ = left_ = 0;
  zero_due_ = bad_ = false;
  if (!whole) return false;
  length_ = static_cast<uint8_t>(used - 2);
  return crc16(payload_, length_) ==
         static_cast<uint16_t>(payload_[length_] | payload_[length_ + 1] << 8);
}

}  // namespace flexura
