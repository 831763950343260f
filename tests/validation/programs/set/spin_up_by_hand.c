/* Spins up without spinup_motors(), before short turns. */
#include <kilolib.h>

static void setup(void) {}
static void loop(void) {
  set_motors(255, 255);
  delay(15);
  set_motors(kilo_turn_left, 0);
  delay(185);
  set_motors(0, 0);
  delay(100);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
