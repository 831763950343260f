/* Phototaxis: towards the light with one sensor. The robot pivots about one leg. When the light has fallen clearly below the
 * maximum of this pivot, it changes to the other leg. Each pivot carries it forward, along a winding path to the light.
 * LED: red on the left pivot, green on the right one. */
#include <kilolib.h>

#define SAMPLES 8
#define SMOOTHING 8                       /* loops over which readings are averaged */
#define FALL 24                           /* the light has fallen by 1/24 of the maximum of this pivot */
#define LONGEST_TICKS (6 * TICKS_PER_SEC) /* half a turn or so: no pivot lasts longer */

static uint16_t best, smooth; /* sums of readings */
static uint8_t left;
static uint32_t pivot_began_at;

/* The sum of some readings. While a message arrives, the sensor cannot be read and returns -1. */
static uint16_t light(void) {
  uint16_t sum = 0;
  uint8_t count = 0;
  while (count < SAMPLES) {
    const int16_t reading = get_ambientlight();
    if (reading < 0) continue;
    sum += reading;
    ++count;
  }
  return sum;
}

static void pivot(uint8_t to_the_left) {
  left = to_the_left;
  best = smooth;
  pivot_began_at = kilo_ticks;
  set_color(left ? RGB(3, 0, 0) : RGB(0, 3, 0));
  spinup_motors();
  set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
}

static void setup(void) {
  smooth = light();
  pivot(1);
}

static void loop(void) {
  const uint16_t now = light();
  if (now > smooth)
    smooth += (now - smooth) / SMOOTHING;
  else
    smooth -= (smooth - now) / SMOOTHING;
  if (smooth > best) best = smooth;
  if (smooth < best - best / FALL || kilo_ticks - pivot_began_at > LONGEST_TICKS) pivot(!left);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
