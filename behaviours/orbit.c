/* Orbit: robot 0 is the star, which stands still and shines white; all others are planets that circle it anticlockwise,
 * using only the distance. A planet always turns. While the star is near, it pivots about its right leg, to the right and
 * outwards; while the star is far, it pivots about its left leg, to the left and inwards. Both pivots carry it forward.
 * LED of a planet: red near, green far, blue while it does not hear the star and waits. */
#include <kilolib.h>

#define STAR 0
#define RADIUS_MM 60
#define FORGET_TICKS (3 * TICKS_PER_SEC)

enum motion { STOP, LEFT, RIGHT };

static message_t light;
static uint8_t hears_star, distance_mm;
static uint32_t heard_at;
static enum motion motion = STOP;

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  if (next != STOP) spinup_motors();
  set_motors(next == LEFT ? kilo_turn_left : 0, next == RIGHT ? kilo_turn_right : 0);
}

static void receive(message_t* message, distance_measurement_t* strength) {
  if (message->type != NORMAL || message->data[0] != STAR) return;
  distance_mm = estimate_distance(strength);
  hears_star = 1;
  heard_at = kilo_ticks;
}

/* Planets do not send, so that no message collides with those of the star. */
static message_t* send(void) { return kilo_uid == STAR ? &light : 0; }

static void setup(void) {
  light.type = NORMAL;
  light.data[0] = STAR;
  light.crc = message_crc(&light);
}

static void loop(void) {
  if (kilo_uid == STAR) {
    set_color(RGB(3, 3, 3));
  } else if (!hears_star || kilo_ticks - heard_at > FORGET_TICKS) {
    set_color(RGB(0, 0, 3));
    move(STOP);
  } else if (distance_mm < RADIUS_MM) {
    set_color(RGB(3, 0, 0));
    move(RIGHT);
  } else {
    set_color(RGB(0, 3, 0));
    move(LEFT);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
