/* Leader election: every robot draws a number of 16 bits and passes on the largest one that it knows. In the end each connected
 * group agrees on one robot, whatever the robots' ids.
 * LED: white at a robot that leads as far as it knows; at all others a colour that follows from the leader's number. */
#include <kilolib.h>

static message_t out;
static uint16_t own, leader;

static void adopt(uint16_t number) {
  leader = number;
  out.type = NORMAL;
  out.data[0] = leader & 0xff;
  out.data[1] = leader >> 8;
  out.crc = message_crc(&out);
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != NORMAL) return;
  const uint16_t number = message->data[0] | (uint16_t)message->data[1] << 8;
  if (number > leader) adopt(number);
}

static message_t* send(void) { return &out; }

static void setup(void) {
  own = rand_hard() | (uint16_t)rand_hard() << 8;
  adopt(own);
}

static void loop(void) {
  static const uint8_t colours[] = {RGB(3, 0, 0), RGB(3, 3, 0), RGB(0, 3, 0),
                                    RGB(0, 3, 3), RGB(0, 0, 3), RGB(3, 0, 3)};
  set_color(leader == own ? RGB(3, 3, 3) : colours[leader % 6]);
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
