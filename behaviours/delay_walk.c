/* Walks a square, timed by delay() alone; messages arrive during the delays.
 * LED: the colour shows the two lowest bits of the number of received messages. */
#include <kilolib.h>
#include <util/delay.h>

static message_t hello;
static uint8_t heard;
uint16_t sides_walked;

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message;
  (void)strength;
  ++heard;
  set_color(RGB(heard & 3, 0, 3));
}

static message_t* send(void) {
  hello.data[0] = sides_walked & 0xff;
  hello.crc = message_crc(&hello);
  return &hello;
}

static void setup(void) { hello.type = NORMAL; }

static void loop(void) {
  static uint8_t corner;
  spinup_motors();
  set_motors(kilo_straight_left, kilo_straight_right);
  delay(3000);
  set_motors(0, 0);
  _delay_ms(250);
  spinup_motors();
  set_motors(kilo_turn_left, 0);
  delay(1900);
  set_motors(0, 0);
  corner = (corner + 1) & 3;
  ++sides_walked;
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
