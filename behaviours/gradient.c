/* Gradient: every robot learns its distance in hops from robot 0, the source: one more than the least distance that it hears. A
 * distance that no neighbour confirms for a while is forgotten, so that the gradient heals when robots leave.
 * LED: white at the source, then red, yellow, green, cyan, blue, magenta, and again from red; off while unknown. */
#include <kilolib.h>

#define SOURCE 0
#define UNKNOWN 255
#define FORGET_TICKS (4 * TICKS_PER_SEC)

static message_t out;
static uint8_t hops = UNKNOWN;
static uint32_t confirmed_at;

static void tell(void) {
  out.type = NORMAL;
  out.data[0] = hops;
  out.crc = message_crc(&out);
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (kilo_uid == SOURCE || message->type != NORMAL || message->data[0] >= UNKNOWN - 1) return;
  const uint8_t through_sender = message->data[0] + 1;
  if (through_sender > hops) return;
  hops = through_sender;
  confirmed_at = kilo_ticks;
  tell();
}

/* A robot without a distance sends nothing. */
static message_t* send(void) { return hops == UNKNOWN ? 0 : &out; }

static void show(void) {
  static const uint8_t colours[] = {RGB(3, 0, 0), RGB(3, 3, 0), RGB(0, 3, 0),
                                    RGB(0, 3, 3), RGB(0, 0, 3), RGB(3, 0, 3)};
  if (hops == UNKNOWN)
    set_color(0);
  else if (hops == 0)
    set_color(RGB(3, 3, 3));
  else
    set_color(colours[(hops - 1) % 6]);
}

static void setup(void) {
  if (kilo_uid == SOURCE) hops = 0;
  tell();
}

static void loop(void) {
  if (kilo_uid != SOURCE && hops != UNKNOWN && kilo_ticks - confirmed_at > FORGET_TICKS) hops = UNKNOWN;
  show();
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
