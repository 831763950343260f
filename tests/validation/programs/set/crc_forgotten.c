/* Sends messages whose CRC nobody sets: no robot may hear one. LED: red once it has heard one. */
#include <kilolib.h>

static message_t hello;
static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message, (void)strength;
  set_color(RGB(3, 0, 0));
}

static void setup(void) { hello.data[0] = 7; }
static void loop(void) {}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
