/* Turns once it has found in ten calls of loop() in a row that a second is over: a count that settles. */
#include <kilolib.h>

static uint8_t count, colour;
static uint32_t since;

static void setup(void) { set_motors(kilo_straight_left, kilo_straight_right); }
static void loop(void) {
  if (kilo_ticks - since < TICKS_PER_SEC) return;
  if (++count < 10) return;
  count = 0;
  since = kilo_ticks;
  colour = (colour + 1) & 3;
  set_color(RGB(colour, 0, 0));
  set_motors(colour & 1 ? kilo_turn_left : 0, colour & 1 ? 0 : kilo_turn_right);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
