/* Cyclic redundancy checks, updated by one octet. Each comment gives the polynomial. */
#ifndef KILOTWIN_UTIL_CRC16_H
#define KILOTWIN_UTIL_CRC16_H

#include <stdint.h>

static inline uint16_t kilotwin_crc_right(uint16_t crc, uint8_t octet, uint16_t polynomial) {
  crc ^= octet;
  for (int i = 0; i < 8; ++i) crc = (uint16_t)(crc & 1 ? crc >> 1 ^ polynomial : crc >> 1);
  return crc;
}

/* CRC-16, reversed 0x8005. */
static inline uint16_t _crc16_update(uint16_t crc, uint8_t octet) { return kilotwin_crc_right(crc, octet, 0xA001); }
/* CRC-CCITT, reversed 0x1021, the checksum of kilolib's messages. */
static inline uint16_t _crc_ccitt_update(uint16_t crc, uint8_t octet) {
  return kilotwin_crc_right(crc, octet, 0x8408);
}

/* CRC-CCITT of XMODEM, 0x1021. */
static inline uint16_t _crc_xmodem_update(uint16_t crc, uint8_t octet) {
  crc = (uint16_t)(crc ^ (uint16_t)octet << 8);
  for (int i = 0; i < 8; ++i) crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
  return crc;
}

/* Dallas 1-Wire, reversed 0x31. */
static inline uint8_t _crc_ibutton_update(uint8_t crc, uint8_t octet) {
  crc ^= octet;
  for (int i = 0; i < 8; ++i) crc = (uint8_t)(crc & 1 ? crc >> 1 ^ 0x8C : crc >> 1);
  return crc;
}

/* CRC-8-CCITT, 0x07. */
static inline uint8_t _crc8_ccitt_update(uint8_t crc, uint8_t octet) {
  crc ^= octet;
  for (int i = 0; i < 8; ++i) crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ 0x07 : crc << 1);
  return crc;
}

#endif
