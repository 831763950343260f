/* Edge following: robot 0 walks along the edge of a group that stands still, using only the distance to the nearest neighbour.
 * It turns away while that neighbour is near and towards it while it is far, and so keeps the group on its left.
 * LED of the walker: red near, green far, blue while it hears no robot and waits. The group is white. */
#include <kilolib.h>

#define WALKER 0
#define DESIRED_MM 55
#define NEIGHBOURS 16
#define FORGET_TICKS (2 * TICKS_PER_SEC)
#define NOBODY 255

enum motion { STOP, LEFT, RIGHT };

static struct {
  uint16_t id;
  uint8_t distance_mm;
  uint32_t heard_at;
} neighbours[NEIGHBOURS];
static uint8_t count;
static message_t hello;
static enum motion motion = STOP;

static void receive(message_t* message, distance_measurement_t* strength) {
  if (kilo_uid != WALKER || message->type != NORMAL) return;
  const uint16_t id = message->data[0] | (uint16_t)message->data[1] << 8;
  uint8_t i = 0;
  while (i < count && neighbours[i].id != id) ++i;
  if (i == NEIGHBOURS) return;
  if (i == count) ++count;
  neighbours[i].id = id;
  neighbours[i].distance_mm = estimate_distance(strength);
  neighbours[i].heard_at = kilo_ticks;
}

static message_t* send(void) { return kilo_uid == WALKER ? 0 : &hello; }

/* Forgets neighbours that it has not heard for a while. Returns the least distance of the others. */
static uint8_t nearest(void) {
  uint8_t least = NOBODY;
  for (uint8_t i = 0; i < count;) {
    if (kilo_ticks - neighbours[i].heard_at > FORGET_TICKS) {
      neighbours[i] = neighbours[--count];
      continue;
    }
    if (neighbours[i].distance_mm < least) least = neighbours[i].distance_mm;
    ++i;
  }
  return least;
}

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  if (next != STOP) spinup_motors();
  set_motors(next == LEFT ? kilo_turn_left : 0, next == RIGHT ? kilo_turn_right : 0);
}

static void setup(void) {
  hello.type = NORMAL;
  hello.data[0] = kilo_uid & 0xff;
  hello.data[1] = kilo_uid >> 8;
  hello.crc = message_crc(&hello);
}

static void loop(void) {
  if (kilo_uid != WALKER) {
    set_color(RGB(3, 3, 3));
    return;
  }
  const uint8_t distance_mm = nearest();
  if (distance_mm == NOBODY) {
    set_color(RGB(0, 0, 3));
    move(STOP);
  } else if (distance_mm < DESIRED_MM) {
    set_color(RGB(3, 0, 0));
    move(RIGHT);
  } else {
    set_color(RGB(0, 3, 0));
    move(LEFT);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
