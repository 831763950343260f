/* Phototaxis: towards the light with one sensor. The sensor looks to the left, so its reading follows a sine as the robot turns.
 * The robot remembers the brightest and the darkest reading. It turns left while it is brighter than their mean and right while it
 * is darker. So it swings about the direction in which the light comes from ahead, and each swing carries it forward. LED: red on
 * the left pivot, green on the right one. */
#include <kilolib.h>

#define SAMPLES 8
#define SMOOTHING 8  /* ticks over which readings are averaged */
#define FADE 512     /* ticks in which the remembered readings approach each other to a third */
#define CONTRAST 8   /* with less than 1/8 of the light as contrast, the robot turns on */
#define HYSTERESIS 8 /* share of the contrast by which the light must pass the mean */

static uint16_t smooth, brightest, darkest; /* sums of SAMPLES readings */
static uint8_t left;

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
  set_color(left ? RGB(3, 0, 0) : RGB(0, 3, 0));
  spinup_motors();
  set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
}

static void remember(void) {
  const uint16_t fade = (brightest - darkest) / FADE + 1;
  if (brightest > darkest + 2 * fade) {
    brightest -= fade;
    darkest += fade;
  }
  if (smooth > brightest) brightest = smooth;
  if (smooth < darkest) darkest = smooth;
}

static void setup(void) {
  smooth = brightest = darkest = light();
  pivot(1);
}

static void loop(void) {
  static uint32_t tick;
  if (kilo_ticks == tick) return;
  tick = kilo_ticks;
  const uint16_t now = light();
  if (now > smooth)
    smooth += (now - smooth) / SMOOTHING;
  else
    smooth -= (smooth - now) / SMOOTHING;
  remember();
  const uint16_t contrast = brightest - darkest, mean = darkest + contrast / 2;
  if (contrast < brightest / CONTRAST) return;
  if (left && smooth < mean - contrast / HYSTERESIS) pivot(0);
  if (!left && smooth > mean + contrast / HYSTERESIS) pivot(1);
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
