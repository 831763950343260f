/* Grazing on a virtual meadow (experiments/ark-meadow.txtpb). The station's message for a robot holds three readings:
 *   bits 0..3   the grass where it stands, 0..15
 *   bits 4..6   the water there, 0..7
 *   bits 7..13  the way to the nest: 0..119 the bearing in steps of 3 degrees, anticlockwise from its heading; 127: it is there
 * On grass it stops and grazes until none is left or it is full. A full robot walks to the nest and comes back hungry.
 * LED: green while it grazes, red on its way to the nest, off while it looks for grass. */
#include <kilolib.h>
#include <stdlib.h>

#define GRASS_TO_STOP 4
#define GRASS_TO_LEAVE 1
#define FULL 40        /* readings on grass */
#define AHEAD_STEPS 18 /* of 3 degrees */
#define ALL_STEPS 120
#define IN_NEST 127
#define STRAIGHT_TICKS 250
#define MOST_TURN_TICKS 120

enum motion { STOP, STRAIGHT, LEFT, RIGHT };

static enum motion motion = STOP;
static uint8_t grazes, eaten, is_full, nest = IN_NEST, has_reading;
static uint32_t leg_ends_at;

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

static void sense(uint16_t word) {
  const uint8_t grass = word & 15;
  nest = word >> 7;
  has_reading = 1;
  if (is_full) {
    if (nest == IN_NEST) {
      is_full = 0;
      eaten = 0;
    }
    return;
  }
  grazes = grass >= (grazes ? GRASS_TO_LEAVE : GRASS_TO_STOP);
  if (grazes && ++eaten >= FULL) {
    is_full = 1;
    grazes = 0;
  }
}

static void receive(message_t* message, distance_measurement_t* strength) {
  uint8_t slot;
  (void)strength;
  if (message->type != 0) return;
  for (slot = 0; slot < 3; ++slot) {
    const uint8_t* octets = message->data + 3 * slot;
    const uint16_t id = (uint16_t)octets[0] << 2 | octets[1] >> 6;
    if (id == kilo_uid) sense((uint16_t)(octets[1] & 63) << 8 | octets[2]);
  }
}

static void wander(void) {
  if (kilo_ticks < leg_ends_at) return;
  if (motion == STRAIGHT) {
    move(rand_soft() & 1 ? LEFT : RIGHT);
    leg_ends_at = kilo_ticks + rand_soft() % MOST_TURN_TICKS + 1;
  } else {
    move(STRAIGHT);
    leg_ends_at = kilo_ticks + STRAIGHT_TICKS;
  }
}

static void setup(void) { rand_seed(rand_hard()); }

static void loop(void) {
  set_color(grazes ? RGB(0, 3, 0) : is_full ? RGB(3, 0, 0) : RGB(0, 0, 0));
  if (grazes) {
    move(STOP);
  } else if (is_full && has_reading && nest < ALL_STEPS) {
    if (nest < AHEAD_STEPS || nest > ALL_STEPS - AHEAD_STEPS)
      move(STRAIGHT);
    else
      move(nest < ALL_STEPS / 2 ? LEFT : RIGHT);
  } else {
    wander();
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
