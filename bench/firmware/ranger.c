/* Shows in its motors how far the last neighbour is that it heard, and backs away in colour: red when near. */
#include <kilolib.h>

static message_t hello;
static volatile uint8_t distance, has_heard;

static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message;
  distance = estimate_distance(strength);
  has_heard = 1;
}

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {
  if (!has_heard) return;
  has_heard = 0;
  set_motors(distance, 255 - distance);
  set_color(distance < 60 ? RGB(3, 0, 0) : RGB(0, 3, 0));
}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
