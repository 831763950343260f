/* Shows in its motors how often it has sent and heard, and in its LED who spoke last. */
#include <kilolib.h>

static message_t hello;
static volatile uint8_t sent, heard;

static message_t* send(void) { return &hello; }
static void note_success(void) { ++sent; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  ++heard;
  set_color(message->data[0] & 63);
}

static void setup(void) {
  hello.data[0] = kilo_uid + 1;
  hello.crc = message_crc(&hello);
}
static void loop(void) { set_motors(sent, heard); }

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_tx_success = note_success;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
