/* Calls spinup_motors() in each loop(): the motors run at full duty nearly all the time, and the turn never shows. */
#include <kilolib.h>

static void setup(void) { set_color(RGB(0, 3, 0)); }
static void loop(void) {
  spinup_motors();
  set_motors(kilo_turn_left, 0);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
