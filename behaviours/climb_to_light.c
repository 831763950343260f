/* Moves to a lamp by comparison with a moment ago: straight while it gets brighter, else a turn to the right. The sensor looks to
 * the left. In a turn to the right the lamp comes into its view from ahead, so it gets brighter just when the robot faces the lamp.
 * A turn to the left would do so with the lamp behind, and the robot would leave. Near the lamp the sensor saturates, so the robot
 * also turns where nothing changes for a while. LED: green straight, red turning. */
#include <kilolib.h>

#define WINDOW 6    /* ticks, a fifth of a second: readings of a window are averaged against their noise */
#define MARGIN 32   /* a change by less than 1/32 of the light is none, nor is one by less than FLOOR */
#define FLOOR 32    /* sixteenths of a count */
#define PATIENCE 30 /* windows without a change, six seconds */

static uint32_t sum, until;
static uint16_t count;
static int32_t before; /* mean of the last window, sixteenths of a count */
static uint8_t straight, unchanged;

static void go(uint8_t ahead) {
  unchanged = 0;
  if (straight == ahead) return;
  straight = ahead;
  set_color(straight ? RGB(0, 3, 0) : RGB(3, 0, 0));
  spinup_motors();
  set_motors(straight ? kilo_straight_left : 0, straight ? kilo_straight_right : kilo_turn_right);
}

static void decide(int32_t now) {
  const int32_t margin = now / MARGIN + FLOOR;
  if (now > before + margin)
    go(1);
  else if (now < before - margin || ++unchanged > PATIENCE)
    go(0);
  before = now;
}

static void setup(void) {
  straight = 1;
  go(0);
  until = kilo_ticks + WINDOW;
  before = 16 * 1023L;
}

static void loop(void) {
  const int16_t reading = get_ambientlight();
  if (reading >= 0) { /* -1: a message is arriving */
    sum += reading;
    ++count;
  }
  if (kilo_ticks < until || count == 0) return;
  decide(16 * sum / count);
  sum = count = 0;
  until = kilo_ticks + WINDOW;
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
