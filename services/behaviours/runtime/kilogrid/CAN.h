/* Messages of a Kilogrid's modules on their cable. In the simulation they reach the dispatcher only: a cell's log. */
#ifndef KILOTWIN_KILOGRID_CAN_H
#define KILOTWIN_KILOGRID_CAN_H

#include <kilogrid.h>
#include <stdint.h>

#define CAN_MESSAGE_SIZE 8

typedef struct {
  uint16_t id;
  struct {
    int8_t rtr : 1;
    uint8_t length : 4;
  } header;
  uint8_t data[CAN_MESSAGE_SIZE];
} CAN_message_t;

typedef enum {
  CAN_MODULE_USER = 0,
  CAN_TRACKING_KILOBOT = 17,
  CAN_KILOBOT_DATA = 18,
  CAN_MODULE_DATA = 19
} CAN_message_type_t;

typedef void (*CAN_message_rx_t)(CAN_message_t*);

#ifdef __cplusplus
extern "C" {
#endif
/* For messages of other modules. Never called: in the simulation modules exchange none. */
extern CAN_message_rx_t module_CAN_message_rx;
void init_CAN_message(CAN_message_t* message);
/* A robot's report with the cell that heard it. */
void serialize_tracking_message(CAN_message_t* message, uint8_t cell, tracking_user_data_t* data);
#ifdef __cplusplus
}
#endif
#endif
