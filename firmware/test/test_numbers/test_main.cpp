// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
// Fixed-point arithmetic, frames, and what the sensors' numbers mean.
#include <math.h>
#include <string.h>

#include "bench.h"
#include "random.h"
#include "session.h"  // PlatformIO looks for libraries in this file only

static const int16_t kEdges[] = {0, 1, -1, 255, -256, INT16_MAX, INT16_MIN};

static void products_equal_exact_ones() {
  for (uint16_t k = 0; k < 600; ++k) {
    const int32_t a =
        k < 49 ? kEdges[k % 7] * 65536L + kEdges[k / 7] : static_cast<int32_t>(random32());
    const int16_t b = k < 343 ? kEdges[k / 49 % 7] : static_cast<int16_t>(random32());
    const uint16_t c = static_cast<uint16_t>(b);
    const int64_t exact = static_cast<int64_t>(a) * b;
    CHECK(signed_product(upper(a), b) == static_cast<int32_t>(upper(a)) * b);
    CHECK(mixed_product(lower(a), b) == static_cast<int32_t>(static_cast<int64_t>(lower(a)) * b));
    CHECK(unsigned_product(lower(a), c) == static_cast<uint32_t>(lower(a)) * c);
    CHECK(multiply_high(a, b) == static_cast<int32_t>(exact >> 16));
    CHECK(multiply_q16(a, c) == static_cast<int32_t>(static_cast<int64_t>(a) * c >> 16));
    CHECK(multiply(a, b) == (exact > kInt32Max   ? kInt32Max
                             : exact < kInt32Min ? kInt32Min
                                                 : static_cast<int32_t>(exact)));
    const int64_t total = static_cast<int64_t>(a) + b;
    CHECK(add(a, b) == (total > kInt32Max   ? kInt32Max
                        : total < kInt32Min ? kInt32Min
                                            : static_cast<int32_t>(total)));
  }
}

static void halves_go_up() {
  for (uint16_t k = 0; k < 600; ++k) {
    const int32_t a =
        k < 49 ? kEdges[k % 7] * 65536L + kEdges[k / 7] : static_cast<int32_t>(random32());
    if (a <= kInt32Max - 0x8000L)
      CHECK(nearest(a) == static_cast<int16_t>((static_cast<int64_t>(a) + 0x8000) >> 16));
  }
  CHECK(nearest(0x7fff) == 0 && nearest(0x8000) == 1 && nearest(-0x8000L) == 0);
}

static void sums_equal_exact_ones() {
  for (uint8_t k = 0; k < 200; ++k) {
    const int32_t start = static_cast<int32_t>(random32());
    Accumulator48 sum(start);
    int64_t exact = start;
    for (uint8_t n = 0; n < 6; ++n) {
      const int32_t a = k < 7 ? (k & 1 ? (1L << 23) - 1 : -(1L << 23) + 1)
                              : static_cast<int32_t>(random32()) >> 8;
      const int16_t b = k < 7 ? kEdges[k] : static_cast<int16_t>(random32());
      sum.add(a, b);
      exact += static_cast<int64_t>(a) * b;
    }
    const int32_t a = static_cast<int32_t>(random32());
    const int16_t b = static_cast<int16_t>(random32());
    sum.add_scaled(a, b);
    exact += static_cast<int64_t>(a) * b;
    const int32_t more = static_cast<int32_t>(random32());
    sum.add(more);
    exact += more;
    CHECK(sum.value() == (exact > kInt32Max   ? kInt32Max
                          : exact < kInt32Min ? kInt32Min
                                              : static_cast<int32_t>(exact)));
    CHECK(sum.integer_part() == static_cast<int32_t>(exact >> 16));
    CHECK(sum.high_word() == static_cast<int16_t>(exact >> 32));
  }
}

static void what_is_not_finite_is_no_number() {
  int32_t fixed;
  CHECK(to_fixed(-1.5f, 65536.0f, fixed) && fixed == -98304);
  Accumulator48 small(7);
  small.add(-9);
  CHECK(small.value() == -2);
  CHECK(!to_fixed(NAN, 1.0f, fixed) && !to_fixed(INFINITY, 1.0f, fixed) &&
        !to_fixed(40000.0f, 65536.0f, fixed));
}

static void crc_is_the_published_one() {
  CHECK(crc32(reinterpret_cast<const uint8_t *>("123456789"), 9) == 0xCBF43926ul);
}

static bool receive(Receiver &receiver, const uint8_t *frame, uint8_t size) {
  bool good = false;
  for (uint8_t k = 0; k < size; ++k) good = receiver.take(frame[k]);
  return good;
}

static void frames_of_all_lengths_come_back() {
  Receiver receiver;
  uint8_t fields[kPayloadMaxBytes], frame[kFrameMaxBytes];
  for (uint8_t size = 0; size <= kPayloadMaxBytes - kHeadBytes; ++size) {
    for (uint8_t k = 0; k < size; ++k)
      fields[k] = size & 1 ? 0 : static_cast<uint8_t>(random32() & random32());
    const uint8_t length = encode(size, 0x0100, fields, size, frame);
    CHECK(length <= kFrameMaxBytes && memchr(frame, 0, length) == frame + length - 1);
    CHECK(receive(receiver, frame, length));
    CHECK(receiver.code() == size && receiver.sequence() == 0x0100 && receiver.size() == size);
    CHECK(memcmp(receiver.fields(), fields, size) == 0);
  }
}

static void damaged_frames_are_none_and_cost_no_other() {
  Receiver receiver;
  const Hello hello = {kDeclaration};
  uint8_t good[kFrameMaxBytes], bad[kFrameMaxBytes];
  const uint8_t length = encode(7, hello, good);
  for (uint8_t k = 0; k + 1 < length; ++k) {
    for (uint8_t bit = 0; bit < 8; ++bit) {
      memcpy(bad, good, length);
      bad[k] = static_cast<uint8_t>(bad[k] ^ 1 << bit);
      CHECK(!receive(receiver, bad, length));
      CHECK(!receiver.take(0));
    }
    CHECK(!receive(receiver, good + k + 1, static_cast<uint8_t>(length - k - 1)));  // cut short
    CHECK(receive(receiver, good, length));
  }
  for (uint16_t k = 0; k < 700; ++k) CHECK(!receiver.take(static_cast<uint8_t>(1 + k % 255)));
  CHECK(!receiver.take(0));
  CHECK(receive(receiver, good, length));
}

static void four_edges_are_four_counts() {
  static const uint8_t up[] = {2, 3, 1, 0}, down[] = {1, 3, 2, 0};
  Quadrature q;
  q.start(0);
  for (uint8_t k = 0; k < 4; ++k) CHECK(q.update(k & 1 ? EncoderLine::b : EncoderLine::a, up[k]));
  CHECK(q.count == 4 && q.missed == 0);
  for (uint8_t k = 0; k < 4; ++k) q.update(k & 1 ? EncoderLine::a : EncoderLine::b, down[k]);
  CHECK(q.count == 0 && q.missed == 0);
  CHECK(q.take_edges(EncoderLine::a) == 4 && q.take_edges(EncoderLine::b) == 4 &&
        q.take_edges(EncoderLine::a) == 0);
  q.update(EncoderLine::a, 3);
  CHECK(q.missed == 1);
  uint8_t n = 1;
  while (q.update(EncoderLine::a, n & 1 ? 2 : 0)) ++n;
  CHECK(n < Quadrature::kEdgesMax);
}

static void deflection_follows_its_polynomial() {
  Config config = default_config();
  config.flex_zero() = 0.6f;
  config.flex_c1_m() = -0.45f;
  config.flex_c2_m() = 0.7f;
  config.flex_c3_m() = -1.1f;
  FixedPointConfig fixed;
  CHECK(to_fixed_point(config, fixed) == kAllValid);
  for (uint16_t reading = 0; reading <= 2 * 1023 * kAdcSamples;
       reading = static_cast<uint16_t>(reading + 97)) {
    const float x = reading / (2.0f * 1024 * kAdcSamples) - config.flex_zero();
    const float w = ((config.flex_c3_m() * x + config.flex_c2_m()) * x + config.flex_c1_m()) * x;
    const float slope =
        (3 * config.flex_c3_m() * x + 2 * config.flex_c2_m()) * x + config.flex_c1_m();
    // A tenth of its unit of 10 um, and half a reading, to which the zero is rounded.
    CHECK(fabs(FlexSensor::raw(fixed.tip, reading) / 25.6e6f - w) <
          1e-6f + fabs(slope) * 0.5f / (2 * 1024 * kAdcSamples));
  }
}

static void filtered_velocity_has_its_time_constant() {
  const uint16_t filter = static_cast<uint16_t>(65536 * (1 - exp(-0.01)));  // 100 ticks
  Velocity velocity;
  float exact = 0;
  for (uint16_t k = 0; k < 500; ++k) {
    velocity.update(10, filter);
    exact += (10 - exact) * filter / 65536.0f;
    if (k % 50 == 0) CHECK(fabs(velocity.value() / 256.0f - exact) < 0.01f);
  }
}

static void tests() {
  RUN(products_equal_exact_ones);
  RUN(halves_go_up);
  RUN(sums_equal_exact_ones);
  RUN(what_is_not_finite_is_no_number);
  RUN(crc_is_the_published_one);
  RUN(frames_of_all_lengths_come_back);
  RUN(damaged_frames_are_none_and_cost_no_other);
  RUN(four_edges_are_four_counts);
  RUN(deflection_follows_its_polynomial);
  RUN(filtered_velocity_has_its_time_constant);
}
CHECK_MAIN(tests())
