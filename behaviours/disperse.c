/* Disperse: robots walk at random while a neighbour is near and stand still when alone, so that a cluster spreads out.
 * LED: green alone, red near a neighbour. */
#include <kilolib.h>

#define NEAR_MM 60
#define MEMORY_TICKS TICKS_PER_SEC

enum motion { STOP, STRAIGHT, LEFT, RIGHT };

static message_t hello;
static volatile uint8_t heard_somebody_near;
static volatile uint32_t heard_near_at;
static enum motion motion = STOP;
static uint32_t motion_until;

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  if (next == STOP) {
    set_motors(0, 0);
    return;
  }
  spinup_motors();
  switch (next) {
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    case LEFT: set_motors(kilo_turn_left, 0); break;
    default: set_motors(0, kilo_turn_right); break;
  }
}

/* A leg lasts one to two seconds: straight on with probability 1/2, else a turn to a random side. */
static void walk_at_random(void) {
  if (motion != STOP && kilo_ticks < motion_until) return;
  const uint8_t choice = rand_soft();
  motion_until = kilo_ticks + TICKS_PER_SEC + choice % TICKS_PER_SEC;
  if (choice & 0x80)
    move(STRAIGHT);
  else
    move(choice & 0x40 ? LEFT : RIGHT);
}

static void receive(message_t* message, distance_measurement_t* strength) {
  if (message->type != NORMAL || estimate_distance(strength) > NEAR_MM) return;
  heard_somebody_near = 1;
  heard_near_at = kilo_ticks;
}

static message_t* send(void) { return &hello; }

static void setup(void) {
  hello.type = NORMAL;
  hello.data[0] = kilo_uid & 0xff;
  hello.data[1] = kilo_uid >> 8;
  hello.crc = message_crc(&hello);
  rand_seed(rand_hard());
}

static void loop(void) {
  if (heard_somebody_near && kilo_ticks - heard_near_at <= MEMORY_TICKS) {
    set_color(RGB(3, 0, 0));
    walk_at_random();
  } else {
    set_color(RGB(0, 3, 0));
    move(STOP);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
