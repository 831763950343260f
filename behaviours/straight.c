/* Drives straight on at the calibrated duties. LED: green. */
#include <kilolib.h>

static void setup(void) {
  set_color(RGB(0, 3, 0));
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
}

static void loop(void) {}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
