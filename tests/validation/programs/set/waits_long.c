/* One long delay() after the other; messages arrive meanwhile and prolong them. */
#include <kilolib.h>

static message_t hello;
static message_t* send(void) { return &hello; }

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {
  set_color(RGB(3, 0, 0));
  set_motors(kilo_turn_left, 0);
  delay(1500);
  set_color(RGB(0, 0, 3));
  set_motors(0, kilo_turn_right);
  delay(700);
}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
