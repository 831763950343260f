/* Approaches a neighbour that is far and turns away from one that is near, by the distance of the last message. */
#include <kilolib.h>

static message_t hello;
static volatile uint8_t distance = 255;
static uint8_t motion;
static message_t* send(void) { return &hello; }
static void receive(message_t* message, distance_measurement_t* strength) {
  (void)message;
  distance = estimate_distance(strength);
}

static void move(uint8_t next) {
  if (next == motion) return;
  motion = next;
  if (next != 0) spinup_motors();
  set_motors(next == 1 ? kilo_turn_left : 0, next == 2 ? kilo_turn_right : 0);
}

static void setup(void) { hello.crc = message_crc(&hello); }
static void loop(void) {
  set_color(distance < 60 ? RGB(3, 0, 0) : RGB(0, 3, 0));
  move(distance == 255 ? 0 : distance < 60 ? 1 : 2);
}

int main(void) {
  kilo_init();
  kilo_message_tx = send;
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
