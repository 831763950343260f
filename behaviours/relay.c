/* Relay: a baton goes round robots 0, 1, 2 ... in the order of their ids, with every kind of waiting. The robot with the baton
 * shines for half a second (delay), waits for a full second of its clock (a busy loop), and then passes the baton on until it
 * hears that the next robot holds it (a busy loop on a variable that the reception callback sets).
 * ROBOTS is the number of robots (kilotwin run --define ROBOTS=5). LED: red with the baton, green while it passes it on. */
#include <kilolib.h>

#ifndef ROBOTS
#define ROBOTS 3
#endif

static message_t out;
static volatile uint8_t passes, holder;

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type == NORMAL) holder = message->data[0];
}

/* Sends the holder of the baton: the next robot while it is passed on, this robot before. */
static message_t* send(void) {
  if (holder != kilo_uid && !passes) return 0;
  out.type = NORMAL;
  out.data[0] = passes ? (kilo_uid + 1) % ROBOTS : kilo_uid;
  out.crc = message_crc(&out);
  return &out;
}

static void setup(void) { holder = 0; }

static void loop(void) {
  while (holder != kilo_uid)
    ;
  set_color(RGB(3, 0, 0));
  delay(500);
  const uint32_t later = kilo_ticks + TICKS_PER_SEC;
  while (kilo_ticks < later)
    ;
  set_color(RGB(0, 3, 0));
  passes = 1;
  while (holder == kilo_uid)
    ;
  passes = 0;
  set_color(0);
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
