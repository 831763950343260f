/* A cell of a Kilogrid, on top of kilolib: it runs its module's program. The EEPROM says which cell it is
 * (core/base/kilogrid_cell.h). */
#include <CAN.h>
#include <avr/eeprom.h>
#include <kilolib.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "../core/base/kilogrid_cell.h"
#include "kilo_rand_lib.c"

volatile uint16_t module_uid;
volatile uint8_t module_uid_x_coord, module_uid_y_coord;
volatile uint8_t configuration_size;
volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

static cell_num_t own;

static void ignore_message(IR_message_t* message, cell_num_t cell, distance_measurement_t* strength,
                           uint8_t wrong) {
  (void)message;
  (void)cell;
  (void)strength;
  (void)wrong;
}
static void ignore_success(cell_num_t cell) { (void)cell; }
CAN_message_rx_t module_CAN_message_rx;
IR_message_rx_t module_IR_message_rx = ignore_message;
IR_message_tx_success_t module_IR_message_tx_success = ignore_success;

/* Infrared. */

static IR_message_t to_send;
static uint8_t sends;

void init_IR_message(IR_message_t* message) { memset(message, 0, sizeof *message); }

void set_IR_message(IR_message_t* message, cell_num_t cell) {
  if (cell != own) return;
  sends = message != NULL;
  if (!sends) return;
  to_send = *message;
  to_send.crc = message_crc(&to_send);
}

void disable_IR_tx(cell_num_t cell) {
  if (cell == own) sends = 0;
}

uint8_t estimate_distance_mm(const distance_measurement_t* strength, cell_num_t cell) {
  (void)cell;
  return estimate_distance(strength);
}

static IR_message_t* offered(void) { return sends ? &to_send : NULL; }
static void succeeded(void) { module_IR_message_tx_success(own); }

/* A module has one receiver, which it switches from cell to cell every 10 ms. A packet is heard if it starts while the receiver
 * listens to the cell: one in four, drawn by the high bits of a congruential generator of its own. */
static uint32_t listening;
static uint8_t listens(void) {
  listening = listening * 1664525u + 1013904223u;
  return listening >> 30 == own;
}

static void received(IR_message_t* message, distance_measurement_t* strength) {
  if (listens()) module_IR_message_rx(message, own, strength, 0);
}

/* LEDs. */

static uint8_t level_of(uint8_t brightness) { return (uint8_t)(1 + brightness / 0x60); }

static void show(color_t color, uint8_t level) {
  const uint8_t red = color & RED ? level : 0, green = color & GREEN ? level : 0, blue = color & BLUE ? level : 0;
  set_color((uint8_t)(red | green << 2 | blue << 4));
}

void set_all_LEDs(color_t color) { show(color, 3); }
void set_all_LEDs_with_brightness(color_t color, brightness_t brightness) { show(color, level_of(brightness)); }
void set_all_LEDs_hex(uint8_t color[]) {
  set_color((uint8_t)(color[0] >> 6 | color[1] >> 6 << 2 | color[2] >> 6 << 4));
}
void set_LED(cell_num_t cell, color_t color) {
  if (cell == own) set_all_LEDs(color);
}
void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness) {
  if (cell == own) set_all_LEDs_with_brightness(color, brightness);
}

/* Messages to the dispatcher. */

static CAN_message_t queue[CAN_MESSAGE_BUFFER_SIZE];
static uint8_t queue_first, queue_length;

void init_CAN_message(CAN_message_t* message) {
  memset(message, 0, sizeof *message);
  message->header.length = CAN_MESSAGE_SIZE;
}

CAN_message_t* next_CAN_message() {
  CAN_message_t* message;
  if (queue_length == CAN_MESSAGE_BUFFER_SIZE) return NULL;
  message = &queue[(queue_first + queue_length++) % CAN_MESSAGE_BUFFER_SIZE];
  init_CAN_message(message);
  return message;
}

void serialize_tracking_message(CAN_message_t* message, uint8_t cell, tracking_user_data_t* data) {
  init_CAN_message(message);
  message->data[0] = (uint8_t)(CAN_TRACKING_KILOBOT | (cell & 3) << 6);
  memcpy(message->data + 1, data->byte, TRACKING_MSG_USER_DATA);
}

/* As lines: "tracking X Y CELL OCTETS" for robots' reports, "can X Y OCTETS" for all others. */
static void pass_on(const CAN_message_t* message) {
  const uint8_t is_report = (message->data[0] & 0x3F) == CAN_TRACKING_KILOBOT;
  uint8_t i;
  printf(is_report ? "tracking %u %u" : "can %u %u", module_uid_x_coord, module_uid_y_coord);
  if (is_report) printf(" %u", message->data[0] >> 6);
  for (i = is_report; i < CAN_MESSAGE_SIZE; ++i) printf(" %u", message->data[i]);
  printf("\n");
}

/* The program. */

static void (*program_loop)(void);

static void loop_and_pass_on(void) {
  program_loop();
  while (queue_length > 0) {
    pass_on(&queue[queue_first]);
    queue_first = (queue_first + 1) % CAN_MESSAGE_BUFFER_SIZE;
    --queue_length;
  }
}

static uint8_t stored(uint16_t address) { return eeprom_read_byte((const uint8_t*)(size_t)address); }

void module_init(void) {
  uint8_t i;
  kilo_init();
  configuration_size = stored(KILOTWIN_CELL_OCTETS);
  if (configuration_size > MODULE_CONFIGURATION_BUFFER_SIZE) {
    configuration_size = 0;
  } else {
    module_uid_x_coord = stored(KILOTWIN_CELL_MODULE_X);
    module_uid_y_coord = stored(KILOTWIN_CELL_MODULE_Y);
    own = stored(KILOTWIN_CELL_NUMBER) & 3;
  }
  for (i = 0; i < configuration_size; ++i) configuration[i] = stored(KILOTWIN_CELL_CONFIGURATION + i);
  module_uid = (uint16_t)(module_uid_y_coord << 8 | module_uid_x_coord);
  listening = kilo_uid * 2654435761u;
  kilo_message_tx = offered;
  kilo_message_tx_success = succeeded;
  kilo_message_rx = received;
}

void module_start(void (*setup)(void), void (*loop)(void)) {
  program_loop = loop;
  kilo_start(setup, loop_and_pass_on);
}
