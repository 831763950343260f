/* Infrared messages of a Kilogrid's cells. */
#ifndef KILOTWIN_KILOGRID_MODULE_IR_H
#define KILOTWIN_KILOGRID_MODULE_IR_H

#include <message.h>
#include <message_crc.h>
#include <module.h>

/* For a message that the cell has received; the last argument: whether its checksum is wrong, which never happens here. */
typedef void (*IR_message_rx_t)(IR_message_t*, cell_num_t, distance_measurement_t*, uint8_t);
typedef void (*IR_message_tx_success_t)(cell_num_t);

#ifdef __cplusplus
extern "C" {
#endif
extern IR_message_rx_t module_IR_message_rx;
extern IR_message_tx_success_t module_IR_message_tx_success;
void init_IR_message(IR_message_t* message);
/* The cell sends a copy of the message twice per second until another is set or disable_IR_tx() is called. NULL: nothing. */
void set_IR_message(IR_message_t* message, cell_num_t cell);
void disable_IR_tx(cell_num_t cell);
uint8_t estimate_distance_mm(const distance_measurement_t* strength, cell_num_t cell);
#ifdef __cplusplus
}
#endif
#endif
