// The configuration in EEPROM, under the declaration's hash and a CRC. Written byte by byte between other work: 3.4 ms each.
#pragma once
#include "declaration.h"

namespace store {

bool load(flexura::Config &config);                  // false: nothing there, damaged, or of another declaration
void begin_save(const flexura::Config &config);
enum class Progress : uint8_t { busy, done, failed };
Progress save();                                     // a step of it

}  // namespace store
