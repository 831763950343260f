/* Blink: red, green, blue, half a second each. */
#include <kilolib.h>

#define HALF_A_SECOND (TICKS_PER_SEC / 2)

static void setup(void) {}

static void loop(void) {
  switch (kilo_ticks / HALF_A_SECOND % 3) {
    case 0: set_color(RGB(1, 0, 0)); break;
    case 1: set_color(RGB(0, 1, 0)); break;
    default: set_color(RGB(0, 0, 1)); break;
  }
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
