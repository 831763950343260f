/* Shows its number: colours, and how long it turns. */
#include <kilolib.h>

static void setup(void) {
  set_color(kilo_uid & 63);
  set_motors(kilo_turn_left, 0);
  delay(500 * (kilo_uid & 7));
  set_motors(0, 0);
}
static void loop(void) {}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
