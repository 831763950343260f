/* Relay: a baton goes round robots 0, 1, 2 ... in the order of their ids, with every kind of waiting. Who holds the baton shines
 * for half a second (delay), waits for a full second of its clock (busy), and then passes the baton on until it hears that the
 * next one holds it (busy, on a variable that the reception sets).
 * ROBOTS tells how many there are (kilotwin run --define ROBOTS=5). LED: red with the baton, green while it passes it on. */
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

/* Says who holds the baton: the next one while it is passed on, oneself before. */
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
