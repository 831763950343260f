/* Towards the hub. The station's virtual sensor tells each robot whether it is inside the hub and in which direction the hub
 * lies, in degrees anticlockwise from the robot's heading. LED: green inside, blue on the way, off until the first reading.
 *
 * A message of type 0 holds three robots' readings of 10 bits id, 4 bits type and 10 bits data:
 *   data[3i] = id >> 2, data[3i + 1] = (id & 3) << 6 | type << 2 | data >> 8, data[3i + 2] = data & 255 */
#include <kilolib.h>

#define INSIDE 1
#define AHEAD_DEG 25
#define READING_LASTS (5 * TICKS_PER_SEC)

enum motion { STOP, STRAIGHT, LEFT, RIGHT };

static volatile uint8_t has_reading, inside;
static volatile uint16_t bearing_deg;
static volatile uint32_t read_at;
static enum motion motion = STOP;

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  if (next != STOP) spinup_motors();
  switch (next) {
    case STOP: set_motors(0, 0); break;
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    case LEFT: set_motors(kilo_turn_left, 0); break;
    case RIGHT: set_motors(0, kilo_turn_right); break;
  }
}

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != 0) return;
  for (uint8_t i = 0; i < 9; i += 3) {
    const uint8_t* slot = message->data + i;
    const uint16_t id = (uint16_t)slot[0] << 2 | slot[1] >> 6;
    if (id != kilo_uid) continue;
    inside = (slot[1] >> 2 & 15) == INSIDE;
    bearing_deg = (uint16_t)(slot[1] & 3) << 8 | slot[2];
    read_at = kilo_ticks;
    has_reading = 1;
  }
}

static void setup(void) {}

static void loop(void) {
  if (!has_reading || kilo_ticks - read_at > READING_LASTS) {
    set_color(RGB(0, 0, 0));
    move(STOP);
  } else if (inside) {
    set_color(RGB(0, 3, 0));
    move(STOP);
  } else {
    set_color(RGB(0, 0, 3));
    if (bearing_deg <= AHEAD_DEG || bearing_deg >= 360 - AHEAD_DEG)
      move(STRAIGHT);
    else
      move(bearing_deg < 180 ? LEFT : RIGHT);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
