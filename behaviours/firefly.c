/* Fireflies: oscillators that couple by pulses alone (Mirollo and Strogatz, SIAM J. Appl. Math. 50, 1990). A robot flashes once per
 * period and sends one message per flash. A robot that hears a flash comes nearer to its own next flash, by a quarter of the time
 * since its last one. For a while after its own flash it ignores others, so that late messages do no harm.
 * sync.c instead sends its phase all the time. LED: white during the flash, else off. */
#include <kilolib.h>

#define PERIOD 124 /* ticks, four seconds */
#define FLASH_TICKS 8
#define DEAF_TICKS 40
#define COUPLING 4

static message_t out;
static uint32_t flashed_at;
static uint8_t announced;

static void flash(uint32_t when) {
  flashed_at = when;
  announced = 0;
}

/* A message says how many ticks ago its sender flashed: carrier sense may have delayed it. */
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != NORMAL) return;
  const uint32_t heard_flash_at = kilo_ticks - message->data[0];
  const int32_t phase = heard_flash_at - flashed_at;
  if (phase <= DEAF_TICKS) return;
  const int32_t jump = phase / COUPLING;
  if (phase + jump >= PERIOD)
    flash(heard_flash_at);
  else
    flashed_at -= jump;
}

static message_t* send(void) {
  const uint32_t age = kilo_ticks - flashed_at;
  if (announced || age > DEAF_TICKS) return 0;
  out.type = NORMAL;
  out.data[0] = age;
  out.crc = message_crc(&out);
  return &out;
}

static void sent(void) { announced = 1; }

static void setup(void) {
  flashed_at = kilo_ticks - rand_hard() % PERIOD;
  announced = 1;
}

static void loop(void) {
  if (kilo_ticks - flashed_at >= PERIOD) flash(kilo_ticks);
  set_color(kilo_ticks - flashed_at < FLASH_TICKS ? RGB(3, 3, 3) : 0);
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_message_tx_success = sent;
  kilo_start(setup, loop);
  return 0;
}
