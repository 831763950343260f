/* Reads the battery all the time. The strength of the next message is then a voltage. LED: red if its sender seems near. */
#include <kilolib.h>

static message_t hello;
static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message;
  set_color(estimate_distance(strength) < 45 ? RGB(3, 0, 0) : RGB(0, 0, 3));
}

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) { get_voltage(); }

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
