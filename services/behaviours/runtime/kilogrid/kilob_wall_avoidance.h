/* Turns away from cells whose messages mark a wall, by their strength. Call kilob_wall_avoidance() in loop(). */
#ifndef KILOTWIN_KILOB_WALL_AVOIDANCE_H
#define KILOTWIN_KILOB_WALL_AVOIDANCE_H

#include <kilolib.h>
#include <message.h>

/* How often a wall's message is passed on: from the cell to a robot, and to a second one. */
#define WALL_DEPTH 2
/* Readings that are added up before they are compared. */
#define WALL_READINGS_BUFFER_SIZE 4

#ifdef __cplusplus
extern "C" {
#endif
void kilob_wall_avoidance_init();
void kilob_on_wall_detected(distance_measurement_t* strength, IR_message_t* message);
/* Whether a wall was heard within the last second. While it is, this function drives. */
uint8_t kilob_wall_avoidance();
void kilob_wall_avoidance_reset();
#ifdef __cplusplus
}
#endif
#endif
