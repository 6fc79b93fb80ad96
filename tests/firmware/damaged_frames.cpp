// Damaged frames into the board's end of a session: damaged_frames FRAMES SEED.
//
// Each is a command that the board would obey now, with the number that it
// waits for, and then some of its bytes wrong, gone, doubled, moved or cut off.
// Counted are those that the receiver takes for whole and those that are obeyed.
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

static uint64_t state_;
static uint32_t random32() {  // Vigna's splitmix64, upper half
  uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
  return static_cast<uint32_t>((z ^ z >> 27) * 0x94D049BB133111EBull >> 32);
}
static unsigned below(size_t n) {
  return static_cast<unsigned>(static_cast<uint64_t>(random32()) * n >> 32);
}

static const struct {
  uint8_t code, size;
} kCommands[] = {
#define ROW(Message) {Message::kCode, Message::kSize},
    FLEXURA_RIG_COMMANDS(ROW) FLEXURA_SESSION_COMMANDS(ROW)
#undef ROW
};

static Bytes command(uint16_t sequence) {
  const auto &which = kCommands[below(sizeof kCommands / sizeof *kCommands)];
  uint8_t fields[kPayloadMaxBytes] = {}, frame[kFrameMaxBytes];
  const bool sparse = below(2);  // small numbers have bytes of 0, which COBS treats in its own way
  for (uint8_t k = 0; k < which.size; ++k)
    fields[k] = sparse && below(3) ? 0 : static_cast<uint8_t>(random32());
  if (which.code == Hello::kCode) memcpy(fields, &kDeclaration, sizeof kDeclaration);
  return Bytes(frame, frame + encode(which.code, sequence, fields, which.size, frame));
}

static uint8_t other(uint8_t byte) { return static_cast<uint8_t>(byte ^ (1 + below(255))); }

static void damage(Bytes &frame, const Bytes &another) {
  const unsigned at = below(frame.size());
  switch (below(8)) {
    case 0:  // single bytes
      for (unsigned n = 1 + below(4); n > 0; --n) {
        const unsigned k = below(frame.size());
        frame[k] = other(frame[k]);
      }
      break;
    case 1:  // single bits
      for (unsigned n = 1 + below(6); n > 0; --n)
        frame[below(frame.size())] ^= static_cast<uint8_t>(1 << below(8));
      break;
    case 2:  // a burst
      for (size_t k = at; k < frame.size() && k < at + 2 + below(12); ++k)
        frame[k] = static_cast<uint8_t>(random32());
      break;
    case 3: frame.erase(frame.begin() + at); break;
    case 4: frame.insert(frame.begin() + at, static_cast<uint8_t>(random32())); break;
    case 5: {  // one overtakes another
      const unsigned k = below(frame.size());
      std::swap(frame[at], frame[k]);
      break;
    }
    case 6: {  // the length of a block grows or shrinks: all after it is read otherwise
      unsigned k = 0;
      for (unsigned n = below(4); n > 0 && k + frame[k] < frame.size(); --n) k += frame[k];
      frame[k] = other(frame[k]);
      break;
    }
    default:  // the rest is of another frame
      frame.resize(at);
      frame.insert(frame.end(), another.begin() + below(another.size()), another.end());
  }
  frame.push_back(0);
}

// Whether what stands between zeros is a frame that was never damaged.
static bool holds(const Bytes &bytes, const Bytes &whole) {
  for (size_t from = 0; from + whole.size() <= bytes.size(); ++from)
    if ((from == 0 || bytes[from - 1] == 0) && std::equal(whole.begin(), whole.end(), &bytes[from]))
      return true;
  return false;
}

int main(int count, char **words) {
  const unsigned long total = count > 1 ? strtoul(words[1], nullptr, 10) : 1000000;
  state_ = count > 2 ? strtoul(words[2], nullptr, 10) : 1;
  Rig rig;
  const Stored stored = {default_config(), 1};
  rig.begin(&stored, 1, 1);
  static const Build build = {{0, 1, 0}, {0, 0, 0}, 1, 1};
  Session session(rig, build);
  Receiver receiver;
  uint8_t answer[Session::kAnswerMaxBytes], frame[kFrameMaxBytes];
  const Hello hello = {kDeclaration};
  uint16_t last = 100;
  const uint8_t size = encode(last, hello, frame);
  for (uint8_t k = 0; k < size; ++k) session.receive(frame[k], answer);
  if (!session.open()) return fprintf(stderr, "no session\n"), 1;
  unsigned long sent = 0, whole = 0, obeyed = 0;
  while (sent < total) {
    const Bytes good = command(static_cast<uint16_t>(last + 1));
    const Bytes another = command(static_cast<uint16_t>(random32()));
    Bytes bad = good;
    damage(bad, another);
    if (holds(bad, good) || holds(bad, another)) continue;
    ++sent;
    for (const uint8_t byte : bad) {
      whole += receiver.take(byte);
      const uint8_t length = session.receive(byte, answer);
      Receiver host;
      for (uint8_t k = 0; k < length; ++k)
        if (host.take(answer[k]) && host.code() == Ack::kCode && host.fields()[1] == 0) {
          ++obeyed;
          last = host.sequence();
        }
    }
  }
  printf("%lu damaged frames, %lu taken for whole, %lu obeyed\n", sent, whole, obeyed);
  return 0;
}
