/* Calls rand_hard() in each loop(), which keeps interrupts off. LED: how many messages it has heard nevertheless. */
#include <kilolib.h>

static message_t hello;
static volatile uint8_t heard;
static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message, (void)strength;
  ++heard;
}

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {
  const uint8_t side = rand_hard();
  set_motors(side & 1 ? kilo_turn_left : 0, side & 1 ? 0 : kilo_turn_right);
  set_color(RGB(heard >> 3 & 3, 0, 0));
  delay(200);
}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
