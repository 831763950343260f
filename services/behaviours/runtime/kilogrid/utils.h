/* Motion of robots on a Kilogrid by direction, and times in ticks of 32 ms. */
#ifndef KILOTWIN_KILOGRID_UTILS_H
#define KILOTWIN_KILOGRID_UTILS_H

#include <kilolib.h>
#include <stdint.h>

/* Largest duties of safe_set_motors(). */
#define MOTOR_LEFT_MAX 100
#define MOTOR_RIGHT_MAX 100
#define MS_PER_TICK 32
/* Without outer parentheses around the arguments, as in the Kilogrid's own header: a program's result may depend on it. */
#define TICKS_TO_MS(a) (a * MS_PER_TICK)
#define MS_TO_TICKS(a) (a / MS_PER_TICK)
#define SEC_TO_TICKS(a) (a * 32)

typedef enum { UNDEFINED = 0, LEFT = 1, RIGHT = 2, STRAIGHT = 3 } direction_t;

#ifdef __cplusplus
extern "C" {
#endif

/* The program's callback for messages, after utils_init(). */
extern message_rx_t utils_message_rx;
/* Takes over kilo_message_rx: messages of types GO_STRAIGHT, TURN_LEFT and TURN_RIGHT move the robot, all others go to
 * utils_message_rx. */
void utils_init();
void init_motors();
void safe_set_motors(uint8_t left, uint8_t right);
/* Spin the motors up for 20 ms if the direction changes. */
void turn_left();
void turn_right();
void move_straight();
void stop();
direction_t get_direction();

#ifdef __cplusplus
}
#endif
#endif
