/* Layout of a Kilobot's EEPROM (kilolib), in C and C++: for robots' programs, hosts and firmware robots.
 *
 *   0x01        OSCCAL, trim of the oscillator; 0xFF: the factory's value
 *   0x05, 0x09  kilo_turn_left, kilo_turn_right
 *   0x0C, 0x14  kilo_straight_left, kilo_straight_right
 *   0x20..0x3B  kilo_irlow, 14 words, high octet first
 *   0x50..0x6B  kilo_irhigh, likewise
 *   0x90        mask of the pins of the infrared transmitter
 *   0xB0, 0xB1  kilo_uid, low octet first
 *
 * All other octets are erased, 0xFF. */
#ifndef KILOTWIN_CORE_BASE_EEPROM_LAYOUT_H
#define KILOTWIN_CORE_BASE_EEPROM_LAYOUT_H

#include <stdint.h>

#include "core/base/ir_calibration.h"

enum {
  KILOTWIN_EEPROM_OCTETS = 1024, /* ATmega328P */
  KILOTWIN_EEPROM_OSCCAL = 0x01,
  KILOTWIN_EEPROM_TURN_LEFT = 0x05,
  KILOTWIN_EEPROM_TURN_RIGHT = 0x09,
  KILOTWIN_EEPROM_STRAIGHT_LEFT = 0x0C,
  KILOTWIN_EEPROM_STRAIGHT_RIGHT = 0x14,
  KILOTWIN_EEPROM_IR_LOW = 0x20,
  KILOTWIN_EEPROM_IR_HIGH = 0x50,
  KILOTWIN_EEPROM_TX_MASK = 0x90,
  KILOTWIN_EEPROM_UID = 0xB0
};

/* Calibration of one robot. */
struct KilotwinCalibration {
  uint16_t uid;
  uint8_t turn_left, turn_right, straight_left, straight_right; /* duties */
};

/* Writes the two ranging tables. */
static inline void kilotwin_fill_ranging(uint8_t* eeprom, const uint16_t* high, const uint16_t* low) {
  for (int i = 0; i < KILOTWIN_IR_ENTRIES; ++i) {
    eeprom[KILOTWIN_EEPROM_IR_LOW + 2 * i] = (uint8_t)(low[i] >> 8);
    eeprom[KILOTWIN_EEPROM_IR_LOW + 2 * i + 1] = (uint8_t)(low[i] & 0xff);
    eeprom[KILOTWIN_EEPROM_IR_HIGH + 2 * i] = (uint8_t)(high[i] >> 8);
    eeprom[KILOTWIN_EEPROM_IR_HIGH + 2 * i + 1] = (uint8_t)(high[i] & 0xff);
  }
}

/* Writes the EEPROM of a calibrated robot with the nominal ranging tables: 1024 octets. */
static inline void kilotwin_fill_eeprom(uint8_t* eeprom, struct KilotwinCalibration robot) {
  const uint16_t low[] = KILOTWIN_IR_LOW, high[] = KILOTWIN_IR_HIGH;
  for (int i = 0; i < KILOTWIN_EEPROM_OCTETS; ++i) eeprom[i] = 0xff;
  eeprom[KILOTWIN_EEPROM_TURN_LEFT] = robot.turn_left;
  eeprom[KILOTWIN_EEPROM_TURN_RIGHT] = robot.turn_right;
  eeprom[KILOTWIN_EEPROM_STRAIGHT_LEFT] = robot.straight_left;
  eeprom[KILOTWIN_EEPROM_STRAIGHT_RIGHT] = robot.straight_right;
  kilotwin_fill_ranging(eeprom, high, low);
  eeprom[KILOTWIN_EEPROM_TX_MASK] = 1;
  eeprom[KILOTWIN_EEPROM_UID] = (uint8_t)(robot.uid & 0xff);
  eeprom[KILOTWIN_EEPROM_UID + 1] = (uint8_t)(robot.uid >> 8);
}

#endif
