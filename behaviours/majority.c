/* Majority vote: every robot holds one of two opinions and sends it. Every few seconds, at its own period, a robot counts the
 * opinions that it has heard since the last count and its own, and adopts the majority. A tie changes nothing.
 * SHARE of ten robots begin with red (kilotwin run --define SHARE=4). LED: the opinion, red or blue. */
#include <kilolib.h>

#ifndef SHARE
#define SHARE 6
#endif

enum opinion { RED, BLUE };

static message_t out;
static enum opinion opinion;
static uint8_t heard[2];
static uint32_t count_at;

static void hold(enum opinion next) {
  opinion = next;
  out.type = NORMAL;
  out.data[0] = opinion;
  out.crc = message_crc(&out);
  set_color(opinion == RED ? RGB(3, 0, 0) : RGB(0, 0, 3));
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != NORMAL || message->data[0] > BLUE) return;
  if (heard[message->data[0]] < 255) ++heard[message->data[0]];
}

static message_t* send(void) { return &out; }

static void wait_for_next_count(void) {
  heard[RED] = heard[BLUE] = 0;
  count_at = kilo_ticks + 2 * TICKS_PER_SEC + rand_soft() % (2 * TICKS_PER_SEC);
}

static void setup(void) {
  rand_seed(rand_hard());
  hold(kilo_uid % 10 < SHARE ? RED : BLUE);
  wait_for_next_count();
}

static void loop(void) {
  if (kilo_ticks < count_at) return;
  const uint16_t red = heard[RED] + (opinion == RED), blue = heard[BLUE] + (opinion == BLUE);
  if (red != blue) hold(red > blue ? RED : BLUE);
  wait_for_next_count();
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
