/* Walks straight on for ten seconds, turns left for two seconds, and repeats. */
#include <kilolib.h>

#define STRAIGHT_TICKS (10 * TICKS_PER_SEC)
#define TURN_TICKS (2 * TICKS_PER_SEC)

static uint8_t turning;
static uint32_t leg_ends_at;

static void go_straight(void) {
  turning = 0;
  leg_ends_at = kilo_ticks + STRAIGHT_TICKS;
  set_color(RGB(0, 3, 0));
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
}

static void turn_left(void) {
  turning = 1;
  leg_ends_at = kilo_ticks + TURN_TICKS;
  set_color(RGB(0, 0, 3));
  spinup_motors();
  set_motors(kilo_turn_left, 0);
}

static void loop(void) {
  if (kilo_ticks < leg_ends_at) return;
  if (turning)
    go_straight();
  else
    turn_left();
}

int main(void) {
  kilo_init();
  kilo_start(go_straight, loop);
  return 0;
}
