/* Adds 300 readings of light in an int of 16 bits, which overflows where it is bright. LED: red below 0, else green. The sum is
 * volatile: a compiler may assume that an int does not overflow, and avr-gcc would drop the comparison with 0. */
#include <kilolib.h>

static void setup(void) {}
static void loop(void) {
  static volatile int sum;
  int count = 0;
  sum = 0;
  while (count < 300) {
    int reading = get_ambientlight();
    if (reading < 0) continue;
    sum = sum + reading;
    ++count;
  }
  set_color(sum < 0 ? RGB(3, 0, 0) : RGB(0, 3, 0));
  if (sum < 0)
    set_motors(kilo_turn_left, 0);
  else
    set_motors(0, kilo_turn_right);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
