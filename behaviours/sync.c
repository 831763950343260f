/* Synchronise: every robot flashes once per period, like a firefly, and sends its phase. For each phase that it hears, it corrects
 * its own by a quarter of the difference, until all robots flash together.
 * LED: white during the flash, else off. */
#include <kilolib.h>

#define PERIOD 124 /* ticks, four seconds */
#define FLASH_TICKS 8

static message_t out;
static uint32_t period_began_at;

static uint8_t phase(void) { return (kilo_ticks - period_began_at) % PERIOD; }

/* The difference from the own phase to the other's, on the circle: -PERIOD / 2 .. PERIOD / 2. */
static int8_t ahead(uint8_t other) {
  int16_t difference = (int16_t)other - phase();
  if (difference > PERIOD / 2) difference -= PERIOD;
  if (difference < -PERIOD / 2) difference += PERIOD;
  return difference;
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != NORMAL) return;
  const int8_t difference = ahead(message->data[0]);
  /* At least one tick if the phases differ by more than a tick. */
  int8_t step = difference / 4;
  if (step == 0 && difference > 1) step = 1;
  if (step == 0 && difference < -1) step = -1;
  period_began_at -= step;
}

/* The phase is read when the message leaves. */
static message_t* send(void) {
  out.type = NORMAL;
  out.data[0] = phase();
  out.crc = message_crc(&out);
  return &out;
}

static void setup(void) { period_began_at = kilo_ticks - rand_hard() % PERIOD; }

static void loop(void) { set_color(phase() < FLASH_TICKS ? RGB(3, 3, 3) : 0); }

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
