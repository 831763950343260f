/* Hop count: robot 0 sends a numbered wave every eight seconds. A robot that hears a new wave stores the number of hops it took,
 * flashes for a second and passes the wave on. It ignores the same wave when it hears it again.
 * LED: off; during the flash green for an odd number of hops, blue for an even number. */
#include <kilolib.h>

#define ORIGIN 0
#define WAVE_TICKS (8 * TICKS_PER_SEC)
#define FLASH_TICKS TICKS_PER_SEC
#define TELL_TICKS (4 * TICKS_PER_SEC)

static message_t out;
static uint8_t wave, hops, has_wave;
static uint32_t wave_came_at;

static void begin_wave(uint8_t number, uint8_t distance) {
  wave = number;
  hops = distance;
  has_wave = 1;
  wave_came_at = kilo_ticks;
  out.type = NORMAL;
  out.data[0] = wave;
  out.data[1] = hops;
  out.crc = message_crc(&out);
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (kilo_uid == ORIGIN || message->type != NORMAL) return;
  /* Numbers wrap round; a wave is new if it is up to half the circle ahead. */
  if (has_wave && (int8_t)(message->data[0] - wave) <= 0) return;
  begin_wave(message->data[0], message->data[1] + 1);
}

static message_t* send(void) { return has_wave && kilo_ticks - wave_came_at < TELL_TICKS ? &out : 0; }

static void setup(void) {
  if (kilo_uid == ORIGIN) begin_wave(1, 0);
}

static void loop(void) {
  if (kilo_uid == ORIGIN && kilo_ticks - wave_came_at >= WAVE_TICKS) begin_wave(wave + 1, 0);
  if (!has_wave || kilo_ticks - wave_came_at >= FLASH_TICKS)
    set_color(0);
  else
    set_color(hops & 1 ? RGB(0, 3, 0) : RGB(0, 0, 3));
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
