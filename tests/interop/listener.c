/* Shows what the overhead controller says: the LED is the first octet of the last message of type 0x42. */
#include <kilolib.h>

static volatile uint8_t color;

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type == 0x42) color = message->data[0];
}

static void setup(void) {}

static void loop(void) { set_color(color); }

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
