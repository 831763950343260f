/* Best-of-two on a Kilogrid (experiments/kilogrid-decision.txtpb): robots decide which of two colours covers more cells, by the
 * majority rule with positive feedback (Valentini and others, 2016). A robot explores for a time and notes the share of cells
 * with the colour of its opinion. It then tells its opinion to others for a time that grows with that share. At the end it takes
 * the majority of its own opinion and the last two that it heard. Messages of cells at the rim turn it back. LED: the opinion, red
 * for colour 1, blue for 2; bright while it tells. */
#include <kilo_rand_lib.h>
#include <kilob_messaging.h>
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
#include <kilob_wall_avoidance.h>
#include <kilolib.h>
#include <utils.h>

#include "grid_messages.h"

enum { EXPLORE_S = 8, LEAST_CELLS = 6, TELL_S = 20, TELL_EVERY_TICKS = 16, HEARD = 2 };

static enum { EXPLORES, TELLS } state;
static uint8_t opinion, heard[HEARD], heard_count;
static uint16_t cells, cells_of_opinion;
static uint32_t until, next_told;
static tracking_user_data_t report;

static void receive(IR_message_t* message, distance_measurement_t* strength) {
  if (message->type == CELL_MESSAGE) {
    if (message->data[CELL_AT_RIM]) {
      kilob_on_wall_detected(strength, message);
    } else if (state == EXPLORES) {
      ++cells;
      if (message->data[CELL_COLOUR] == opinion) ++cells_of_opinion;
    }
  } else if (message->type == OPINION_MESSAGE && state == TELLS) {
    heard[heard_count % HEARD] = message->data[OPINION_COLOUR];
    ++heard_count;
  }
}

/* An exponentially distributed time. */
static uint32_t ticks_of(double mean_s) {
  return mean_s > 0 ? SEC_TO_TICKS((uint32_t)(g_ran_exponential(1 / mean_s) + 0.5)) : 0;
}

static void explore(void) {
  state = EXPLORES;
  cells = cells_of_opinion = 0;
  until = kilo_ticks + ticks_of(EXPLORE_S);
  set_color(opinion == 1 ? RGB(1, 0, 0) : RGB(0, 0, 1));
}

static void tell(void) {
  const double share = (double)cells_of_opinion / cells;
  state = TELLS;
  heard_count = 0;
  until = kilo_ticks + ticks_of(TELL_S * share);
  set_color(opinion == 1 ? RGB(3, 0, 0) : RGB(0, 0, 3));
}

static void decide(void) {
  if (heard_count >= HEARD && heard[0] == heard[1]) opinion = heard[0];
  explore();
}

static void setup(void) {
  g_ran_set_seed_uint32(0);
  kilob_tracking_init();
  kilob_random_walk_init(8, 2, 0.5, 2);
  kilob_wall_avoidance_init();
  opinion = rand_hard() & 1 ? 1 : 2;
  explore();
}

static void loop(void) {
  if (!kilob_wall_avoidance()) kilob_random_walk();
  if (state == TELLS && kilo_ticks > next_told) {
    IR_message_t* const message = kilob_message_send();
    next_told = kilo_ticks + TELL_EVERY_TICKS;
    if (message != NULL) {
      message->type = OPINION_MESSAGE;
      message->data[OPINION_COLOUR] = opinion;
      message->data[OPINION_ROBOT] = (uint8_t)kilo_uid;
    }
  }
  if (kilo_ticks > until) {
    if (state == TELLS)
      decide();
    else if (cells >= LEAST_CELLS)
      tell();
  }
  report.byte[0] = (uint8_t)kilo_uid;
  report.byte[1] = opinion;
  kilob_tracking(&report);
}

int main(void) {
  kilo_init();
  utils_init();
  utils_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
