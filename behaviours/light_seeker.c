/* Phototaxis by run and tumble: straight on while it gets brighter, into another direction when it gets darker. A robot has one
 * light sensor and cannot tell where light comes from, only how it changes on its way. */
#include <kilolib.h>

enum { SPAN = 32 };                       /* ticks, about 1 s, over which readings are averaged */
enum { TURN_LEAST = 16, TURN_MOST = 96 }; /* ticks of a turn */

static uint32_t sum, before, span_ends, turn_ends;
static uint16_t readings;
static uint8_t turning;

static void straight(void) {
  turning = 0;
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
}

static void turn(void) {
  turning = 1;
  turn_ends = kilo_ticks + TURN_LEAST + rand_hard() % (TURN_MOST - TURN_LEAST);
  spinup_motors();
  if (rand_hard() & 1)
    set_motors(kilo_turn_left, 0);
  else
    set_motors(0, kilo_turn_right);
}

static void begin_span(void) {
  sum = readings = 0;
  span_ends = kilo_ticks + SPAN;
}

static void setup(void) {
  straight();
  begin_span();
}

static void loop(void) {
  const int16_t light = get_ambientlight();
  if (light >= 0) { /* else a message was arriving */
    sum += light;
    ++readings;
  }
  if (turning) {
    if (kilo_ticks < turn_ends) return;
    straight();
    before = 0;
    begin_span();
  } else if (kilo_ticks >= span_ends && readings > 0) {
    const uint32_t mean = sum * 16 / readings;
    const uint8_t darker = mean < before;
    set_color(darker ? RGB(1, 0, 0) : RGB(0, 1, 0));
    before = mean;
    begin_span();
    if (darker) turn();
  }
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
