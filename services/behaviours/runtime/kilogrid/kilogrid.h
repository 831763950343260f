/* Names that robots and modules of a Kilogrid share: addresses, commands, tracking data. */
#ifndef KILOTWIN_KILOGRID_H
#define KILOTWIN_KILOGRID_H

#include <stdint.h>

typedef enum {
  KILOGRID_STOP_IR = 0xC0,
  KILOGRID_IDLE = 0xC1,
  KILOGRID_SETUP = 0xC2,
  KILOGRID_RUN_EXP = 0xC3,
  KILOGRID_PAUSE_EXP = 0xC4,
  KILOGRID_BOOTLOAD = 0xC5
} kilogrid_command_type_t;

typedef enum __attribute__((packed)) {
  ADDR_BROADCAST = 0,
  ADDR_ROW = 1,
  ADDR_COLUMN = 2,
  ADDR_INDIVIDUAL = 3,
  ADDR_DISPATCHER = 0xFF
} kilogrid_addressing_type_t;

typedef struct __attribute__((packed)) {
  uint8_t x, y; /* column and row of modules */
  kilogrid_addressing_type_t type;
} kilogrid_address_t;

/* Octets of a tracking message that programs may choose. */
#define TRACKING_MSG_USER_DATA 7

typedef struct __attribute__((packed)) {
  uint8_t byte[TRACKING_MSG_USER_DATA];
} tracking_user_data_t;

#endif
