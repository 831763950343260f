/* A crowd that a tracker must follow: straight on for up to eight seconds, then a turn to a random side for up to four. The LED takes
 * another colour, or none, every LED_TICKS on average. bench/camera-model sets them. */
#include <kilolib.h>

#define LED_TICKS 61 /* two seconds */
#define STRAIGHT_TICKS 244
#define TURN_TICKS 122

static uint32_t leg_ends_at, led_changes_at;
static uint8_t turning = 1;

/* Uniform over 1..2 x mean. */
static uint32_t about(uint32_t mean) { return 1 + (2 * mean * rand_hard() >> 8); }

static void change_leg(void) {
  turning = !turning;
  spinup_motors();
  if (!turning)
    set_motors(kilo_straight_left, kilo_straight_right);
  else if (rand_hard() & 0x80)
    set_motors(kilo_turn_left, 0);
  else
    set_motors(0, kilo_turn_right);
  leg_ends_at = kilo_ticks + about((turning ? TURN_TICKS : STRAIGHT_TICKS) / 2);
}

static void change_led(void) {
  static const uint8_t colours[] = {RGB(0, 0, 0), RGB(3, 0, 0), RGB(0, 3, 0), RGB(0, 0, 3)};
  set_color(colours[rand_hard() >> 6]);
  led_changes_at = kilo_ticks + about(LED_TICKS);
}

static void setup(void) {}

static void loop(void) {
  if (kilo_ticks >= leg_ends_at) change_leg();
  if (kilo_ticks >= led_changes_at) change_led();
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
