/* A grid of robots that measures which robot hears which. Each robot sends its id again and again, for 150 * 32 of its own
 * kilo_ticks. After each message it waits TAU_S * 32 kilo_ticks; with TAU_S 0 it always has a message to send.
 * LED: green while it takes part, off when it is done. */
#include <kilolib.h>

#ifndef TAU_S
#define TAU_S 0
#endif

#define DURATION_TICKS (150ul * 32)
#define PAUSE_TICKS ((uint32_t)(TAU_S * 32))

static message_t own_id;
static volatile uint8_t has_sent;
static volatile uint32_t sent_at;
static uint32_t started_at;

static uint8_t is_over(void) { return kilo_ticks - started_at >= DURATION_TICKS; }

static message_t* offer(void) {
  if (is_over()) return 0;
  if (has_sent && kilo_ticks - sent_at < PAUSE_TICKS) return 0;
  return &own_id;
}

static void note_success(void) {
  has_sent = 1;
  sent_at = kilo_ticks;
}

static void setup(void) {
  started_at = kilo_ticks;
  own_id.type = NORMAL;
  own_id.data[0] = kilo_uid & 0xff;
  own_id.data[1] = kilo_uid >> 8;
  own_id.crc = message_crc(&own_id);
}

static void loop(void) { set_color(is_over() ? RGB(0, 0, 0) : RGB(0, 1, 0)); }

int main(void) {
  kilo_init();
  kilo_message_tx = offer;
  kilo_message_tx_success = note_success;
  kilo_start(setup, loop);
  return 0;
}
