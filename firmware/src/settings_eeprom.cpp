// Copyright (c) 2026 the flexura authors. SPDX-License-Identifier: MIT
#include "settings_eeprom.h"

#include <avr/eeprom.h>
#include <string.h>

#include "frame.h"

namespace {

struct __attribute__((packed)) Image {
  uint32_t declaration;
  flexura::Stored stored;
  uint32_t crc;
};
uint8_t *const kPlace = reinterpret_cast<uint8_t *>(16);
constexpr uint16_t kChecked = sizeof(Image) - sizeof(uint32_t);

Image image;
uint16_t written;

const uint8_t *bytes() { return reinterpret_cast<const uint8_t *>(&image); }

}  // namespace

namespace eeprom {

bool load(flexura::Stored &stored) {
  eeprom_read_block(&image, kPlace, sizeof image);
  if (image.declaration != flexura::kDeclaration || image.crc != flexura::crc32(bytes(), kChecked))
    return false;
  memcpy(&stored, &image.stored, sizeof stored);
  return true;
}

void begin_save(const flexura::Stored &stored) {
  image.declaration = flexura::kDeclaration;
  memcpy(&image.stored, &stored, sizeof stored);
  image.crc = flexura::crc32(bytes(), kChecked);
  written = 0;
}

Progress save() {
  if (!eeprom_is_ready()) return Progress::busy;
  if (written < sizeof image) {
    eeprom_update_byte(kPlace + written, bytes()[written]);
    ++written;
    return Progress::busy;
  }
  for (uint16_t i = 0; i < sizeof image; ++i)
    if (eeprom_read_byte(kPlace + i) != bytes()[i]) return Progress::failed;
  return Progress::done;
}

}  // namespace eeprom
