/* A random walk by rand_soft(), one step per half second. */
#include <kilolib.h>

static void setup(void) { rand_seed(kilo_uid + 1); }
static void loop(void) {
  static uint32_t last;
  if (kilo_ticks < last + 16) return;
  last = kilo_ticks;
  const uint8_t side = rand_soft() & 3;
  set_color(side);
  spinup_motors();
  set_motors(side == 1 ? 0 : kilo_turn_left, side == 2 ? 0 : kilo_turn_right);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
