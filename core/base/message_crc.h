/* Checksum of an infrared message: CRC-16/MCRF4XX over its nine octets of data and its type. In C and C++: for the radio,
 * hosts, robots' programs and firmware robots. */
#ifndef KILOTWIN_CORE_BASE_MESSAGE_CRC_H
#define KILOTWIN_CORE_BASE_MESSAGE_CRC_H

#include <stdint.h>

/* `octets`: the message's ten octets. */
static inline uint16_t kilotwin_message_crc(const uint8_t* octets) {
  uint16_t crc = 0xffff;
  for (uint8_t i = 0; i < 10; ++i) {
    uint8_t x = (uint8_t)(octets[i] ^ (uint8_t)crc);
    x = (uint8_t)(x ^ (uint8_t)(x << 4));
    crc = (uint16_t)(((uint16_t)x << 8 | crc >> 8) ^ (uint8_t)(x >> 4) ^ (uint16_t)x << 3);
  }
  return crc;
}

#endif
