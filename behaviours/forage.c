/* Foraging with the ARK station: from the food to the home and back. The station's virtual sensors tell each robot where its goal
 * lies, in the packed messages that ark_hub.c describes:
 *   type 0       it is inside its goal
 *   type 1..13   it is outside, and a higher type is farther away; data is the bearing of the goal, in degrees anticlockwise
 *                from its heading
 *   type 14      it changes its goal: data 0 to the home (it now carries food), 1 to the food (it has put its food down)
 *   type 15      there is no food left
 * Inside its goal it stops and asks for the change by its blue LED. Without a bearing it walks at random.
 * LED: red while it carries food, green on its way to the food, blue while it asks, off when there is none left.
 * Broadcast 120 is the station's identification, as in housekeeping.c: the robot stops, and shows blue for its own number, red for
 * others; 0xFFFF ends it. */
#include <kilolib.h>
#include <stdlib.h>

#define AHEAD_DEG 55
#define BEARING_LASTS 160 /* ticks */
#define STRAIGHT_TICKS 320
#define MOST_TURN_TICKS 160
#define SWAP_LOCK_TICKS 100
#define IDENTIFY 120
#define NOBODY 0xffff
#define IDENTIFICATION_TICKS 320 /* without a further question it is over */

enum motion { STOP, STRAIGHT, LEFT, RIGHT };
enum { INSIDE = 0, SWAP = 14, NO_FOOD = 15 };

static uint8_t carries, asks, has_ended, has_bearing, ever_swapped;
static uint16_t bearing_deg, asked_number = NOBODY;
static uint32_t bearing_at, swapped_at, leg_ends_at, asked_at;
static enum motion motion = STOP;

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  if (next != STOP) spinup_motors();
  switch (next) {
    case STOP: set_motors(0, 0); break;
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    case LEFT: set_motors(kilo_turn_left, 0); break;
    case RIGHT: set_motors(0, kilo_turn_right); break;
  }
}

static void sense(uint8_t type, uint16_t data) {
  if (type == INSIDE) {
    asks = 1;
    has_bearing = 0;
  } else if (type == SWAP) {
    /* The station repeats its message; the robot changes its goal once. */
    if (ever_swapped && kilo_ticks - swapped_at < SWAP_LOCK_TICKS) return;
    ever_swapped = 1;
    swapped_at = kilo_ticks;
    carries = data == 0;
    asks = has_bearing = 0;
  } else if (type == NO_FOOD) {
    has_ended = 1;
  } else {
    asks = 0;
    has_bearing = 1;
    bearing_deg = data % 360;
    bearing_at = kilo_ticks;
  }
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type == IDENTIFY) {
    asked_number = (uint16_t)message->data[0] << 8 | message->data[1];
    asked_at = kilo_ticks;
  }
  if (message->type != 0) return;
  for (uint8_t i = 0; i < 9; i += 3) {
    const uint8_t* slot = message->data + i;
    if (((uint16_t)slot[0] << 2 | slot[1] >> 6) != kilo_uid) continue;
    sense(slot[1] >> 2 & 15, (uint16_t)(slot[1] & 3) << 8 | slot[2]);
  }
}

static void walk_at_random(void) {
  if (motion != STOP && kilo_ticks < leg_ends_at) return;
  if (motion == STRAIGHT) {
    move(rand() & 1 ? LEFT : RIGHT);
    leg_ends_at = kilo_ticks + rand() % MOST_TURN_TICKS + 1;
  } else {
    move(STRAIGHT);
    leg_ends_at = kilo_ticks + STRAIGHT_TICKS;
  }
}

static void setup(void) { srand(rand_hard() << 8 | rand_hard()); }

static void loop(void) {
  if (asked_number != NOBODY && kilo_ticks - asked_at < IDENTIFICATION_TICKS) {
    set_color(asked_number == kilo_uid ? RGB(0, 0, 3) : RGB(3, 0, 0));
    move(STOP);
  } else if (has_ended && !carries) {
    set_color(0);
    move(STOP);
  } else if (asks) {
    set_color(RGB(0, 0, 3));
    move(STOP);
  } else {
    set_color(carries ? RGB(3, 0, 0) : RGB(0, 3, 0));
    if (!has_bearing || kilo_ticks - bearing_at > BEARING_LASTS)
      walk_at_random();
    else if (bearing_deg < AHEAD_DEG || bearing_deg > 360 - AHEAD_DEG)
      move(STRAIGHT);
    else
      move(bearing_deg < 180 ? LEFT : RIGHT);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
