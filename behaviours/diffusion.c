/* Diffusion: an isotropic random walk. Straight on for ten seconds, then a turn to a random side for up to four seconds, which at
 * 0.8 rad/s is about half a circle; then the next leg.
 * LED: green straight on, blue to the left, red to the right. */
#include <kilolib.h>

/* kilo_ticks last 32.768 ms. */
#define SECONDS(s) ((uint32_t)((s)*1000000UL / 32768))
#define STRAIGHT_TICKS SECONDS(10)
#define LONGEST_TURN_TICKS SECONDS(4)

static uint8_t turning = 1;
static uint32_t leg_ends_at;

static void go_straight(void) {
  set_color(RGB(0, 3, 0));
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
  leg_ends_at = kilo_ticks + STRAIGHT_TICKS;
}

static void turn(void) {
  const uint8_t left = rand_hard() & 0x80;
  set_color(left ? RGB(0, 0, 3) : RGB(3, 0, 0));
  spinup_motors();
  if (left)
    set_motors(kilo_turn_left, 0);
  else
    set_motors(0, kilo_turn_right);
  /* Uniform over 0..LONGEST_TURN_TICKS. */
  leg_ends_at = kilo_ticks + ((LONGEST_TURN_TICKS + 1) * rand_hard() >> 8);
}

static void setup(void) {}

static void loop(void) {
  if (kilo_ticks < leg_ends_at) return;
  turning = !turning;
  if (turning)
    turn();
  else
    go_straight();
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
