/* Speaker and listener: robot 0 sends the number of the present period of two seconds; all others listen. A listener shows the last
 * number that it heard and how far away the speaker seems to be.
 * LED of a listener: red for an even number and blue for an odd one; with far neighbours magenta and cyan; off when it hears
 * nothing. LED of the speaker: white. */
#include <kilolib.h>

#define SPEAKER 0
#define PERIOD (2 * TICKS_PER_SEC)
#define FAR_MM 50
#define FORGET_TICKS (2 * TICKS_PER_SEC)

static message_t out;
static volatile uint8_t number, distance_mm, heard;
static volatile uint32_t heard_at;

static void receive(message_t* message, distance_measurement_t* strength) {
  if (message->type != NORMAL) return;
  number = message->data[0];
  distance_mm = estimate_distance(strength);
  heard_at = kilo_ticks;
  heard = 1;
}

static message_t* send(void) {
  if (kilo_uid != SPEAKER) return 0;
  out.type = NORMAL;
  out.data[0] = kilo_ticks / PERIOD;
  out.crc = message_crc(&out);
  return &out;
}

static void setup(void) {}

static void loop(void) {
  const uint8_t far = distance_mm > FAR_MM;
  if (kilo_uid == SPEAKER)
    set_color(RGB(3, 3, 3));
  else if (!heard || kilo_ticks - heard_at > FORGET_TICKS)
    set_color(0);
  else if (number & 1)
    set_color(far ? RGB(0, 3, 3) : RGB(0, 0, 3));
  else
    set_color(far ? RGB(3, 0, 3) : RGB(3, 0, 0));
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
