/* Computes for some ticks between two colours. */
#include <kilolib.h>

static volatile uint16_t sum;

static void setup(void) {}
static void loop(void) {
  static uint8_t lit;
  for (uint16_t i = 0; i < 60000; ++i) sum += i;
  lit = !lit;
  set_color(lit ? RGB(0, 3, 0) : 0);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
