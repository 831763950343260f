/* Measures time by the number of calls of loop(): straight on for 200,000 of them, then a turn as long. */
#include <kilolib.h>

static uint32_t calls;
static uint8_t turns;

static void setup(void) { set_motors(kilo_straight_left, kilo_straight_right); }
static void loop(void) {
  if (++calls < 200000) return;
  calls = 0;
  turns = !turns;
  set_color(turns ? RGB(3, 0, 0) : RGB(0, 3, 0));
  set_motors(kilo_straight_left, turns ? 0 : kilo_straight_right);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
