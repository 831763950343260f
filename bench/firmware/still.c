/* Stands still and talks. */
#include <kilolib.h>

static message_t hello;

static message_t* send(void) { return &hello; }
static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
