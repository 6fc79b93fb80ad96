// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Frames: COBS(payload, CRC-32 little-endian) and a zero byte.
//
// The CRC is that of IEEE 802.3 and zlib: polynomial 0x04C11DB7, reflected. One of 16 bits let 8 of
// 10^7 damaged frames pass (tests/firmware/damaged_frames.cpp); 32 bits let 2^16 times fewer pass.
#pragma once
#include "declaration.h"

namespace flexura {

constexpr uint8_t kHeadBytes = 3;  // code, sequence
constexpr uint8_t kCrcBytes = 4;
constexpr uint8_t kFrameMaxBytes = kPayloadMaxBytes + kCrcBytes + 1 + 1;  // COBS, the zero

// `crc` is that of the bytes before, so that a CRC may be computed in parts.
uint32_t crc32(const uint8_t *data, uint16_t size, uint32_t crc = 0);

// Code, sequence number and fields as a frame; returns its length.
uint8_t encode(uint8_t code, uint16_t sequence, const void *fields, uint8_t size, uint8_t *frame);

template <class Message>
uint8_t encode(uint16_t sequence, const Message &message, uint8_t *frame) {
  return encode(Message::kCode, sequence, &message, Message::kSize, frame);
}

// Takes bytes as they come; noise costs no more than the frame it falls into.
class Receiver {
 public:
  // True when this byte ends a good frame; then code(), sequence(), fields() and size() are its own
  // until the next byte.
  bool take(uint8_t byte);

  uint8_t code() const { return payload_[0]; }
  uint16_t sequence() const { return static_cast<uint16_t>(payload_[1] | payload_[2] << 8); }
  const uint8_t *fields() const { return payload_ + kHeadBytes; }
  uint8_t size() const { return static_cast<uint8_t>(length_ - kHeadBytes); }

 private:
  bool finish();
  void append(uint8_t byte);

  uint8_t payload_[kPayloadMaxBytes + kCrcBytes];
  uint8_t used_ = 0, length_ = 0;
  uint8_t left_ = 0;       // bytes of the COBS block still to come
  bool zero_due_ = false;  // the block ends in a zero, if another one follows
  bool bad_ = false;
};

}  // namespace flexura
