/* Moves to a lamp by looking around first. The robot turns once to the left and notes the brightest and the darkest reading. It
 * turns on until the reading has passed the brightest one and fallen to the mean: the sensor looks to the left, so the lamp is
 * then ahead. It drives for a while and looks again. LED: red while it looks around, blue while it aims, green on its way. */
#include <kilolib.h>

enum { SAMPLES = 32, LOOK_TICKS = 620, AIM_MOST_TICKS = 930, GO_TICKS = 250 };

static enum { LOOK, AIM, GO } state;
static uint8_t was_bright;
static uint16_t brightest, darkest;
static uint32_t until;

static uint16_t light(void) {
  uint16_t sum = 0;
  uint8_t count = 0;
  while (count < SAMPLES) {
    const int16_t reading = get_ambientlight();
    if (reading < 0) continue; /* a message is arriving */
    sum += reading;
    ++count;
  }
  return sum;
}

static void look(void) {
  state = LOOK;
  until = kilo_ticks + LOOK_TICKS;
  brightest = 0;
  darkest = 0xFFFF;
  set_color(RGB(3, 0, 0));
  spinup_motors();
  set_motors(kilo_turn_left, 0);
}

static void aim(void) {
  state = AIM;
  until = kilo_ticks + AIM_MOST_TICKS;
  was_bright = 0;
  set_color(RGB(0, 0, 3));
}

static void go(void) {
  state = GO;
  until = kilo_ticks + GO_TICKS;
  set_color(RGB(0, 3, 0));
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
}

static void setup(void) { look(); }

static void loop(void) {
  const uint16_t now = light();
  switch (state) {
    case LOOK:
      if (now > brightest) brightest = now;
      if (now < darkest) darkest = now;
      if (kilo_ticks > until) aim();
      break;
    case AIM:
      if (now > brightest - (brightest - darkest) / 8) was_bright = 1;
      if ((was_bright && now < darkest + (brightest - darkest) / 2) || kilo_ticks > until) go();
      break;
    case GO:
      if (kilo_ticks > until) look();
      break;
  }
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
