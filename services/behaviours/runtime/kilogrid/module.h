/* The programming interface of a Kilogrid's modules. A module has two by two cells; in the simulation each cell runs the
 * module's program for itself, and only its own messages, LED and receptions count. */
#ifndef KILOTWIN_KILOGRID_MODULE_H
#define KILOTWIN_KILOGRID_MODULE_H

#include <CAN.h>
#include <kilogrid.h>
#include <kilolib.h>
#include <stddef.h>
#include <stdint.h>

#define N_CELLS 4
#define CELL_LOWER_INDEX 0
#define CELL_UPPER_INDEX (CELL_LOWER_INDEX + (N_CELLS - 1))
#define MODULE_CONFIGURATION_BUFFER_SIZE 48
#define CAN_MESSAGE_BUFFER_SIZE 10

#undef TICKS_PER_SEC
#define TICKS_PER_SEC 32
#define SEC_TO_TICKS(a) (a) * TICKS_PER_SEC
#define MS_TO_TICKS(a) (a / 32)

/* Of a module as seen from above: top left, top right, bottom left, bottom right. */
typedef enum { CELL_00 = 0, CELL_01 = 1, CELL_02 = 2, CELL_03 = 3 } cell_num_t;

/* The module's clock is the cell's. */
#define module_ticks kilo_ticks

#ifdef __cplusplus
extern "C" {
#endif
extern volatile uint16_t module_uid; /* 256 y + x */
extern volatile uint8_t module_uid_x_coord, module_uid_y_coord;
/* The octets of the experiment's .kconf file for this module. */
extern volatile uint8_t configuration_size;
extern volatile uint8_t configuration[MODULE_CONFIGURATION_BUFFER_SIZE];

void module_init(void);
/* After RUN: calls setup() once, then loop() for ever. Does not return. */
void module_start(void (*setup)(void), void (*loop)(void));
/* A message for the dispatcher, to be filled; the simulation writes it to the cell's log. NULL: the queue is full. */
CAN_message_t* next_CAN_message();
#ifdef __cplusplus
}
#endif
#endif
