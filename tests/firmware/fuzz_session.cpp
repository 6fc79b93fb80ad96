// The board's end of the session and its control tick under libFuzzer, with
// sanitizers. An input is a list of records:
//
//     0 n bytes             n bytes on the line as they are
//     1 code fields         a whole frame of a command, with the number that is waited for
//     2 code n fields       a whole frame with any code and n bytes of fields
//     3 low high code ...   a whole frame of a command with another number
//     4 n inputs            n ticks with such inputs
//     5 ok                  the settings are stored, or not
//
// The checksum is computed here: no fuzzer would find it. Compiled with
// REPLAY the program runs the files that it is given, without libFuzzer.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "session.h"

using namespace flexura;

CriticalSection::CriticalSection() : before_(0) {}
CriticalSection::~CriticalSection() { (void)before_; }
InterruptLock::InterruptLock() : before_(0) {}
InterruptLock::~InterruptLock() { (void)before_; }

#define REQUIRE(condition)                                             \
  do {                                                                 \
    if (!(condition)) fprintf(stderr, "not so: " #condition), abort(); \
  } while (0)

static const struct {
  uint8_t code, size;
} kCommands[] = {
#define ROW(Message) {Message::kCode, Message::kSize},
    FLEXURA_RIG_COMMANDS(ROW) FLEXURA_SESSION_COMMANDS(ROW)
#undef ROW
};

namespace {
// The input, read to its end and zero from there on.
struct Data {
  const uint8_t *at, *end;
  bool left() const { return at < end; }
  uint8_t byte() { return left() ? *at++ : 0; }
  void bytes(uint8_t *out, size_t size) {
    for (size_t k = 0; k < size; ++k) out[k] = byte();
  }
};

constexpr Build kBuild = {{0, 1, 0}, {0, 0, 0}, 1, 1};

class Board {
 public:
  Board() : session_(rig_, kBuild) {
    const Stored stored = {default_config(), 1};  // the stop is proven for firmware 1
    rig_.begin(&stored, 1, 1);
    rest();
    tick();
  }

  void line(uint8_t byte) {
    uint8_t answer[Session::kAnswerMaxBytes];
    check_answer(answer, session_.receive(byte, answer));
  }

  void frame(uint8_t code, uint16_t sequence, const uint8_t *fields, uint8_t size) {
    uint8_t bytes[kFrameMaxBytes];
    const uint8_t length = encode(code, sequence, fields, size, bytes);
    REQUIRE(length <= sizeof bytes);
    for (uint8_t k = 0; k < length; ++k) line(bytes[k]);
  }

  void tick() {
    if (session_.begin_saving()) REQUIRE(session_.saving());
    rig_.prepare();
    rig_.tick(out_);
    REQUIRE(out_.on == rig_.active());
    REQUIRE(out_.on || (out_.duty[0] == 0 && out_.duty[1] == 0 && out_.steps.count == 0));
    for (const int16_t duty : out_.duty) REQUIRE(duty >= -800 && duty <= 800);
    uint8_t bytes[kFrameMaxBytes];
    REQUIRE(session_.telemetry(0, bytes) <= sizeof bytes);
    REQUIRE(session_.announce(bytes) <= sizeof bytes);
  }

  void stored(bool well) {
    uint8_t answer[Session::kAnswerMaxBytes];
    if (session_.saving()) check_answer(answer, session_.saved(well, answer));
  }

  // Nothing moves, all is well.
  void rest() {
    rig_.inputs() = Inputs();
    rig_.inputs().flex = 2048;
    rig_.inputs().supply = 500;
  }
  Inputs &inputs() { return rig_.inputs(); }
  uint16_t next() const { return next_; }

 private:
  void check_answer(const uint8_t *answer, uint8_t size) {
    REQUIRE(size <= Session::kAnswerMaxBytes);
    Receiver host;
    bool whole = size == 0;
    for (uint8_t k = 0; k < size; ++k) {
      whole = host.take(answer[k]);
      if (!whole || host.code() != Ack::kCode) continue;
      Ack ack;
      memcpy(&ack, host.fields(), sizeof ack);
      if (ack.result == static_cast<uint8_t>(Result::out_of_sequence))
        next_ = ack.detail;
      else if (ack.result == static_cast<uint8_t>(Result::ok))
        next_ = static_cast<uint16_t>(host.sequence() + 1);
    }
    REQUIRE(whole);
  }

  Rig rig_;
  Session session_;
  Outputs out_;
  uint16_t next_ = 0;
};
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  Data data = {bytes, bytes + size};
  Board board;
  uint8_t fields[kPayloadMaxBytes] = {};
  memcpy(fields, &kDeclaration, sizeof kDeclaration);
  board.frame(Hello::kCode, 0, fields, Hello::kSize);
  while (data.left()) switch (data.byte() % 6) {
      case 0:
        for (unsigned n = data.byte(); n > 0 && data.left(); --n) board.line(data.byte());
        break;
      case 1: {
        const auto &which = kCommands[data.byte() % (sizeof kCommands / sizeof *kCommands)];
        data.bytes(fields, which.size);
        if (which.code == Hello::kCode && (fields[0] & 1))
          memcpy(fields, &kDeclaration, sizeof kDeclaration);
        board.frame(which.code, board.next(), fields, which.size);
        break;
      }
      case 2: {
        const uint8_t code = data.byte(), length = data.byte() % (kPayloadMaxBytes - kHeadBytes);
        data.bytes(fields, length);
        board.frame(code, board.next(), fields, length);
        break;
      }
      case 3: {
        const uint16_t low = data.byte();
        const uint16_t sequence = static_cast<uint16_t>(low | data.byte() << 8);
        const auto &which = kCommands[data.byte() % (sizeof kCommands / sizeof *kCommands)];
        data.bytes(fields, which.size);
        board.frame(which.code, sequence, fields, which.size);
        break;
      }
      case 4: {
        const uint8_t times = data.byte(), what = data.byte();
        Inputs &in = board.inputs();
        board.rest();
        if (what & 1) in.moved[0] = static_cast<int8_t>(data.byte());
        if (what & 2) in.moved[1] = static_cast<int8_t>(data.byte());
        if (what & 4) data.bytes(in.missed, 2);
        if (what & 8) data.bytes(in.edges[0], 4);
        if (what & 16) in.stepped = static_cast<int8_t>(data.byte() % 9 - 4);
        if (what & 32) in.flex = static_cast<uint16_t>((data.byte() | data.byte() << 8) & 4095);
        if (what & 64) in.supply = static_cast<uint16_t>((data.byte() | data.byte() << 8) & 1023);
        if (what & 128) {
          const uint8_t bits = data.byte();
          in.switches = bits & 7;
          in.flooded[0] = bits >> 3 & 1;
          in.flooded[1] = bits >> 4 & 1;
        }
        for (unsigned n = times; n > 0; --n) board.tick();
        break;
      }
      default: board.stored(data.byte() & 1);
    }
  board.tick();
  return 0;
}

#ifdef REPLAY
int main(int count, char **names) {
  for (int k = 1; k < count; ++k) {
    FILE *file = fopen(names[k], "rb");
    REQUIRE(file);
    static uint8_t bytes[1 << 16];
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    uint8_t *own = static_cast<uint8_t *>(malloc(size));  // reading past its end is seen
    memcpy(own, bytes, size);
    LLVMFuzzerTestOneInput(own, size);
    free(own);
  }
  printf("%d inputs\n", count - 1);
  return 0;
}
#endif
