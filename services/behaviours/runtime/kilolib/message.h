/* The infrared message of a Kilobot and its types. */
#ifndef KILOTWIN_MESSAGE_H
#define KILOTWIN_MESSAGE_H

#include <stdint.h>

typedef struct message_t {
  uint8_t data[9]; /* payload */
  uint8_t type;    /* message_type_t; programs may choose any value below 0x80 */
  uint16_t crc;    /* message_crc() of data and type */
} __attribute__((packed)) message_t;

typedef enum {
  NORMAL = 0,
  GPS = 1,
  BOOT = 0x80,
  BOOTPGM_PAGE = 0x81,
  BOOTPGM_SIZE = 0x82,
  RESET = 0x83,
  SLEEP = 0x84,
  WAKEUP = 0x85,
  CHARGE = 0x86,
  VOLTAGE = 0x87,
  RUN = 0x88,
  READUID = 0x89,
  CALIB = 0x8A
} message_type_t;

#ifdef KILOTWIN_KILOGRID
/* The Kilogrid's kilolib has another name for the same message, and further types. */
typedef message_t IR_message_t;

typedef enum {
  TEST = 0x0A,
  TRACKING = 0x10,
  GO_STRAIGHT = 0x7D,
  TURN_LEFT = 0x7E,
  TURN_RIGHT = 0x7F
} IR_message_type_t;
#endif

typedef enum {
  CALIB_SAVE = 0,
  CALIB_UID = 1,
  CALIB_TURN_LEFT = 2,
  CALIB_TURN_RIGHT = 3,
  CALIB_STRAIGHT = 4
} calibmode_t;

/* Payloads of CALIB, GPS and BOOTPGM_PAGE messages, little-endian. */
typedef struct __attribute__((packed)) {
  uint8_t mode;
  uint16_t uid;
  uint8_t turn_left, turn_right, straight_left, straight_right;
  uint16_t unused;
} calibmsg_t;

typedef struct __attribute__((packed)) {
  uint16_t id;
  int16_t x, y;
  int8_t theta;
  uint16_t unused;
} gpsmsg_t;

typedef struct __attribute__((packed)) {
  uint8_t page_address, page_offset;
  uint16_t word1, word2, word3;
  uint8_t unused;
} bootmsg_t;

#endif
