/* Moves to a lamp by two fixed thresholds, as in the classical laboratory exercise: turn left until it is dark, then right until it
 * is bright. The sensor looks to the left. The thresholds suit one lamp in a dark room; phototaxis.c finds its own. */
#include <kilolib.h>

#ifndef BRIGHT
#define BRIGHT 600
#endif
#ifndef DARK
#define DARK 300
#endif
#define SAMPLES 100 /* against the noise of single readings */

static uint8_t left;

/* The mean of some readings. A sum of 100 readings needs 32 bits: an int has 16. */
static int16_t light(void) {
  uint32_t sum = 0;
  uint8_t count = 0;
  while (count < SAMPLES) {
    const int16_t reading = get_ambientlight();
    if (reading < 0) continue; /* a message is arriving */
    sum += reading;
    ++count;
  }
  return sum / SAMPLES;
}

static void turn(uint8_t to_the_left) {
  left = to_the_left;
  set_color(left ? RGB(3, 0, 0) : RGB(0, 3, 0));
  spinup_motors();
  set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
}

static void setup(void) { turn(1); }

static void loop(void) {
  const int16_t now = light();
  if (left && now < DARK)
    turn(0);
  else if (!left && now > BRIGHT)
    turn(1);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
