/* Drives at part of the speed by switching its motors on and off faster than the tick. */
#include <kilolib.h>

static void setup(void) {}
static void loop(void) {
  set_motors(kilo_straight_left, kilo_straight_right);
  delay(6);
  set_motors(0, 0);
  delay(6);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
