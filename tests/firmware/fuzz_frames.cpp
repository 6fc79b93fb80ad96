// Random and mutated bytes into the board's end of the session: fuzz_frames
// BYTES SEED. Built with sanitizers by test_lib_fuzz.py.
//
// The judge of what is a good frame is written anew here, whole frames at a
// time, and shares nothing with the board's receiver.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "session.h"

using namespace flexura;
using Bytes = std::vector<uint8_t>;

CriticalSection::CriticalSection() : before_(0) {}
CriticalSection::~CriticalSection() { (void)before_; }
InterruptLock::InterruptLock() : before_(0) {}
InterruptLock::~InterruptLock() { (void)before_; }

static uint32_t crc_by_bits(const Bytes &bytes, size_t size) {
  uint32_t crc = 0xFFFFFFFF;
  for (size_t i = 0; i < size; ++i)
    for (int bit = 0; bit < 8; ++bit)
      crc = crc >> 1 ^ ((crc ^ bytes[i] >> bit) & 1 ? 0xEDB88320 : 0);
  return ~crc;
}

// The payload of a frame (without its zero), or nothing.
static bool judge(const Bytes &frame, Bytes &payload) {
  payload.clear();
  for (size_t at = 0; at < frame.size();) {
    const uint8_t code = frame[at++];
    if (at + code - 1 > frame.size()) return false;
    payload.insert(payload.end(), frame.begin() + at, frame.begin() + at + code - 1);
    at += code - 1;
    if (code != 255 && at < frame.size()) payload.push_back(0);
  }
  if (payload.size() < 7 || payload.size() > kPayloadMaxBytes + 4u) return false;
  uint32_t crc = 0;
  for (unsigned k = 0; k < 4; ++k)
    crc |= static_cast<uint32_t>(payload[payload.size() - 4 + k]) << 8 * k;
  payload.resize(payload.size() - 4);
  return crc_by_bits(payload, payload.size()) == crc;
}

static std::mt19937_64 random_;
static unsigned below(unsigned n) { return static_cast<unsigned>(random_() % n); }

static Bytes some_frame(uint16_t sequence) {
  static const uint8_t codes[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
  static const uint8_t sizes[] = {4, 0, 0, 12, 1, 52, 36, 1, 0, 1, 1, 5, 0, 0};
  const unsigned which = below(sizeof codes);
  uint8_t fields[64], frame[kFrameMaxBytes];
  for (uint8_t &byte : fields) byte = below(3) ? static_cast<uint8_t>(random_()) : 0;
  if (codes[which] == 1 && below(4)) memcpy(fields, &kDeclaration, 4);
  const uint8_t size = below(8) ? sizes[which] : static_cast<uint8_t>(below(62));
  return Bytes(frame,
               frame + encode(codes[which], below(4) ? sequence : static_cast<uint16_t>(random_()),
                              fields, size, frame));
}

static void mutate(Bytes &frame) {
  for (unsigned n = below(4); n > 0 && !frame.empty(); --n) {
    const size_t at = below(static_cast<unsigned>(frame.size()));
    switch (below(5)) {
      case 0: frame[at] = static_cast<uint8_t>(frame[at] ^ 1 << below(8)); break;
      case 1: frame[at] = static_cast<uint8_t>(random_()); break;
      case 2: frame.erase(frame.begin() + at); break;
      case 3: frame.insert(frame.begin() + at, static_cast<uint8_t>(random_())); break;
      default: frame.resize(at);
    }
  }
}

int main(int count, char **words) {
  const unsigned long total = count > 1 ? strtoul(words[1], nullptr, 10) : 100000;
  random_.seed(count > 2 ? strtoul(words[2], nullptr, 10) : 1);
  static Rig rig;
  const Stored stored = {default_config(), 1};
  rig.begin(&stored, 1, 1);
  rig.inputs().flex = 3500;
  rig.inputs().supply = 500;
  static const Build build = {{0, 1, 0}, {0, 0, 0}, 1, 1};
  static Session session(rig, build);
  Receiver receiver;
  Outputs out;
  Bytes frame, payload;
  unsigned long sent = 0, good = 0, obeyed = 0;
  uint16_t sequence = 0;
  while (sent < total) {
    Bytes bytes = below(4) ? some_frame(sequence) : Bytes(below(100));
    if (bytes.empty() || bytes[0] == 0)
      for (uint8_t &byte : bytes) byte = static_cast<uint8_t>(random_());
    if (below(2)) mutate(bytes);
    for (const uint8_t byte : bytes) {
      ++sent;
      uint8_t answer[Session::kAnswerMaxBytes];
      const bool accepted = receiver.take(byte);
      const uint8_t size = session.receive(byte, answer);
      if (size > sizeof answer) return fprintf(stderr, "an answer of %u bytes\n", size), 1;
      if (byte) {
        if (accepted) return fprintf(stderr, "accepted in the middle of a frame\n"), 1;
        frame.push_back(byte);
        continue;
      }
      const bool right = judge(frame, payload);
      if (accepted != right)
        return fprintf(stderr, "a frame of %zu bytes: accepted %d, is good %d\n", frame.size(),
                       accepted, right),
               1;
      if (right) {
        ++good;
        if (receiver.code() != payload[0] || receiver.size() != payload.size() - kHeadBytes ||
            memcmp(receiver.fields(), payload.data() + kHeadBytes, receiver.size()))
          return fprintf(stderr, "a frame came out changed\n"), 1;
      }
      if (size) {
        Receiver host;
        for (uint8_t k = 0; k < size; ++k)
          if (host.take(answer[k]) && host.code() == Ack::kCode) {
            Ack ack;
            memcpy(&ack, host.fields(), sizeof ack);
            obeyed += ack.result == static_cast<uint8_t>(Result::ok);
            sequence = static_cast<uint16_t>(host.sequence() + (ack.result == 0));
          }
      }
      frame.clear();
      if (session.saving()) session.saved(below(2), answer);
      rig.prepare();
      rig.tick(out);
      if (out.on != rig.active() || (!out.on && (out.duty[0] || out.duty[1])))
        return fprintf(stderr, "outputs on in state %d\n", static_cast<int>(rig.state())), 1;
    }
  }
  printf("%lu bytes, %lu good frames, %lu commands obeyed\n", sent, good, obeyed);
  return 0;
}
