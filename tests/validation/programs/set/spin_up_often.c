/* Spins up before each of its short steps: 15 ms at full duty, then 40 ms straight on. */
#include <kilolib.h>

static void setup(void) {}
static void loop(void) {
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
  delay(40);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
