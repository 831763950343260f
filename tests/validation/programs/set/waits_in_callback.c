/* Waits 30 ms in the callback of each message, with interrupts off. LED: the number of messages, in two bits. */
#include <kilolib.h>

static message_t hello;
static uint8_t heard;
static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message, (void)strength;
  ++heard;
  set_color(RGB(heard & 3, 0, 0));
  delay(30);
}

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
