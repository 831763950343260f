/* The library of robots on a Kilogrid, on top of kilolib. Functions are weak: those that a program defines itself take their
 * place. */
#include <kilo_rand_lib.h>
#include <kilob_messaging.h>
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
#include <kilob_wall_avoidance.h>
#include <kilolib.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <utils.h>

#include "kilo_rand_lib.c"

/* Motion. */

static direction_t direction = UNDEFINED;

static void ignore(IR_message_t* message, distance_measurement_t* strength) {
  (void)message;
  (void)strength;
}
WEAK message_rx_t utils_message_rx = ignore;

static void receive(IR_message_t* message, distance_measurement_t* strength) {
  switch (message->type) {
    case GO_STRAIGHT: move_straight(); break;
    case TURN_LEFT: turn_left(); break;
    case TURN_RIGHT: turn_right(); break;
    default: utils_message_rx(message, strength);
  }
}

WEAK void utils_init() { kilo_message_rx = receive; }

WEAK void safe_set_motors(uint8_t left, uint8_t right) {
  set_motors(left < MOTOR_LEFT_MAX ? left : MOTOR_LEFT_MAX, right < MOTOR_RIGHT_MAX ? right : MOTOR_RIGHT_MAX);
}

static void drive(direction_t next, uint8_t left, uint8_t right) {
  if (direction == next) return;
  direction = next;
  set_motors(255, 255);
  delay(20);
  safe_set_motors(left, right);
}

WEAK void turn_left() { drive(LEFT, kilo_turn_left, 0); }
WEAK void turn_right() { drive(RIGHT, 0, kilo_turn_right); }
WEAK void move_straight() { drive(STRAIGHT, kilo_straight_left, kilo_straight_right); }
WEAK void stop() {
  direction = UNDEFINED;
  set_motors(0, 0);
}
WEAK void init_motors() { stop(); }
WEAK direction_t get_direction() { return direction; }

/* Messages to send. */

enum { QUEUED = 3 };
static IR_message_t queue[QUEUED];
static uint8_t queue_first, queue_length, queue_in_use;

static IR_message_t* next_queued(void) {
  IR_message_t* const message = &queue[queue_first];
  if (queue_length == 0) return NULL;
  message->crc = message_crc(message);
  return message;
}

static void drop_queued(void) {
  if (queue_length == 0) return; /* emptied while the message was on the air */
  queue_first = (queue_first + 1) % QUEUED;
  --queue_length;
}

WEAK void kilob_messaging_init() {
  if (!queue_in_use) {
    queue_in_use = 1;
    kilo_message_tx = next_queued;
    kilo_message_tx_success = drop_queued;
  }
  queue_first = queue_length = 0;
}

WEAK IR_message_t* kilob_message_send() {
  if (queue_length == QUEUED) return NULL;
  return &queue[(queue_first + queue_length++) % QUEUED];
}

/* Tracking. */

enum { TRACKING_PERIOD_MS = 2000 };
static uint32_t next_tracking;

WEAK void kilob_tracking_init() {
  next_tracking = 0;
  kilob_messaging_init();
}

WEAK void kilob_tracking(tracking_user_data_t* data) {
  IR_message_t* message;
  uint8_t i;
  if (kilo_ticks <= next_tracking) return;
  next_tracking = kilo_ticks + MS_TO_TICKS(TRACKING_PERIOD_MS);
  message = kilob_message_send();
  if (message == NULL) return;
  for (i = 0; i < TRACKING_MSG_USER_DATA; ++i) message->data[i] = data->byte[i];
  message->type = TRACKING;
}

/* Random walk. */

static enum { WALK_BEGIN, WALK_STRAIGHT, WALK_TURN } walk_state;
static double straight_mean = 3, straight_sd = 1.5, turn_mean = 1.5, turn_sd = 3; /* s */
static uint32_t walk_until;

WEAK void kilob_random_walk_reset() { walk_state = WALK_BEGIN; }

WEAK void kilob_random_walk_init(double straight_mean_s, double straight_sd_s, double turn_mean_s,
                                 double turn_sd_s) {
  straight_mean = straight_mean_s;
  straight_sd = straight_sd_s;
  turn_mean = turn_mean_s;
  turn_sd = turn_sd_s;
  kilob_random_walk_reset();
}

WEAK void kilob_random_walk() {
  if (walk_state == WALK_BEGIN) {
    walk_until = kilo_ticks + INT_GAUSSIAN_TICKS(straight_mean, straight_sd);
    move_straight();
    walk_state = WALK_STRAIGHT;
  } else if (kilo_ticks > walk_until && walk_state == WALK_STRAIGHT) {
    walk_until = kilo_ticks + INT_GAUSSIAN_TICKS(turn_mean, turn_sd);
    if (g_ran_uniform() > 0.5)
      turn_left();
    else
      turn_right();
    walk_state = WALK_TURN;
  } else if (kilo_ticks > walk_until) {
    walk_state = WALK_BEGIN;
  }
}

/* Wall avoidance: turn until the cells' messages get weaker, then go straight. After 7.5 s turn to the other side. */

enum { WALL_FORGOTTEN_S = 1, WALL_LONGEST_TURN_MS = 7500 };
static enum { WALL_FOUND, WALL_TURN, WALL_ESCAPE } wall_state;
static uint8_t wall_heard, wall_readings, wall_is_new;
static uint16_t wall_sum, wall_strength, wall_before;
static uint32_t wall_until, wall_turn_until;

static void forget_readings(void) {
  wall_readings = 0;
  wall_sum = wall_strength = wall_before = 0;
}

WEAK void kilob_wall_avoidance_init() { wall_readings = 0; }
WEAK void kilob_wall_avoidance_reset() { wall_state = WALL_FOUND; }

WEAK void kilob_on_wall_detected(distance_measurement_t* strength, IR_message_t* message) {
  (void)message;
  wall_heard = 1;
  wall_until = kilo_ticks + SEC_TO_TICKS(WALL_FORGOTTEN_S);
  if (wall_readings == 0) wall_sum = 0;
  wall_sum += (uint16_t)strength->high_gain;
  if (++wall_readings < WALL_READINGS_BUFFER_SIZE) return;
  wall_readings = 0;
  wall_before = wall_strength;
  wall_strength = wall_sum;
  wall_is_new = 1;
}

static void turn_from_wall(direction_t side) {
  if (side == LEFT)
    turn_left();
  else
    turn_right();
  forget_readings();
  wall_turn_until = kilo_ticks + MS_TO_TICKS(WALL_LONGEST_TURN_MS);
}

WEAK uint8_t kilob_wall_avoidance() {
  if (kilo_ticks > wall_until) {
    wall_heard = 0;
    wall_state = WALL_FOUND;
  }
  if (!wall_heard) return 0;
  if (wall_state == WALL_FOUND) {
    turn_from_wall(g_ran_uniform() > 0.5 ? LEFT : RIGHT);
    wall_state = WALL_TURN;
    return 1;
  }
  if (wall_state == WALL_TURN && kilo_ticks > wall_turn_until)
    turn_from_wall(get_direction() == LEFT ? RIGHT : LEFT);
  if (!wall_is_new) return 1;
  wall_is_new = 0;
  if (wall_state == WALL_TURN && wall_before > wall_strength) {
    move_straight();
    wall_state = WALL_ESCAPE;
  } else if (wall_state == WALL_ESCAPE && wall_before < wall_strength) {
    wall_state = WALL_FOUND;
  }
  return 1;
}
