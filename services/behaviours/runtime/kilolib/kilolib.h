/* The programming interface of a Kilobot, with the names, types and meanings of kilolib. */
#ifndef KILOTWIN_KILOLIB_H
#define KILOTWIN_KILOLIB_H

#include <stdint.h>

#include "message.h"
#include "message_crc.h"

/* Two bits per colour, 0..3 each. Without outer parentheses, as in kilolib: a program's result may depend on it. */
#define RGB(r, g, b) (r & 3) | (((g & 3) << 2)) | ((b & 3) << 4)
/* Approximate ticks of the robot's clock per second. */
#define TICKS_PER_SEC 31

/* Strength of a received message, 10-bit ADC counts. */
typedef struct {
  int16_t low_gain;
  int16_t high_gain;
} distance_measurement_t;

typedef void (*message_rx_t)(message_t*, distance_measurement_t* d);
typedef message_t* (*message_tx_t)(void);
typedef void (*message_tx_success_t)(void);

#ifdef __cplusplus
extern "C" {
#endif

extern volatile uint32_t kilo_ticks;
/* Timer counts of 128 us between messages; 3906 = 0.5 s. */
extern volatile uint16_t kilo_tx_period;
extern uint16_t kilo_uid;
/* Calibrated duties. */
extern uint8_t kilo_turn_left;
extern uint8_t kilo_turn_right;
extern uint8_t kilo_straight_left;
extern uint8_t kilo_straight_right;

/* Callbacks, called like interrupts: for a received message; for a message to send (NULL: none); after it has been sent. */
extern message_rx_t kilo_message_rx;
extern message_tx_t kilo_message_tx;
extern message_tx_success_t kilo_message_tx_success;

/* Distance of the sender, centre to centre, mm. */
uint8_t estimate_distance(const distance_measurement_t* d);
void delay(uint16_t ms);
/* Declared without void, so that C ignores surplus arguments, as on the robot. */
uint8_t rand_hard();
uint8_t rand_soft();
void rand_seed(uint8_t seed);
int16_t get_ambientlight();
int16_t get_voltage();
int16_t get_temperature();
void set_motors(uint8_t left, uint8_t right);
/* Both motors at full duty for 15 ms, to overcome static friction. */
void spinup_motors();
void set_color(uint8_t color);
void kilo_init();
/* After the overhead controller's RUN: calls setup() once, then loop() for ever. Does not return. */
void kilo_start(void (*setup)(void), void (*loop)(void));

#ifdef __cplusplus
}
#endif
#endif
