/* Follow the leader: robot 0 drives ahead, and robot n follows robot n - 1 by the distance alone. A follower pivots about one leg,
 * which carries it forward and turns it. When the distance shrinks less fast than it did on this leg, the robot ahead lies on the
 * other side, so the follower changes legs. It stops when it is close.
 * How robots wait (kilotwin run --define WAIT=0):
 * 2, the default: of two neighbours in the chain one moves at a time. A robot drives on when its follower is close and stands.
 * 1: a robot that is followed stops while the gap is wide, but both may move at once.
 * 0: nobody waits.
 * With 0 and 1 the chain breaks: by the distance alone, a wrong heading looks like a robot ahead that leaves.
 * LED: white the leader, green close to the robot ahead, yellow on the way, blue without the robot ahead. */
#include <kilolib.h>

#ifndef WAIT
#define WAIT 2
#endif
#define LEADER 0
#define CLOSE_MM 45       /* a follower stops */
#define OPEN_MM 60        /* a follower starts; one that it follows may go on */
#define WIDE_MM 75        /* one that is followed waits */
#define INTERVAL_TICKS 16 /* between two messages of a robot */
#define MARGIN_MM 2       /* per interval: by so much the approach slows down before the robot changes legs */
#define GAIN_MM 1         /* per interval: a robot that approaches on neither leg faces away, and turns on */
#define NO_RATE -1000
#define FORGET_TICKS (3 * TICKS_PER_SEC)

enum motion { STOP, STRAIGHT, LEFT, RIGHT };

/* The robot ahead and the robot behind. */
struct neighbour {
  uint8_t known, fresh, stands, distance_mm;
  uint32_t heard_at;
};

static struct neighbour ahead, behind;
static message_t out;
static enum motion motion = STOP;
static enum motion side = LEFT;
static uint8_t last_mm, tried;
static int16_t best_rate; /* of approach on this leg, quarters of a mm per interval */
static uint32_t last_at;

static void hear(struct neighbour* one, const message_t* message, distance_measurement_t* strength) {
  one->stands = message->data[1] == STOP;
  one->distance_mm = estimate_distance(strength);
  one->heard_at = kilo_ticks;
  one->known = one->fresh = 1;
}

static void receive(message_t* message, distance_measurement_t* strength) {
  if (message->type != NORMAL) return;
  if (message->data[0] + 1 == kilo_uid)
    hear(&ahead, message, strength);
  else if (message->data[0] == kilo_uid + 1)
    hear(&behind, message, strength);
}

static message_t* send(void) {
  out.type = NORMAL;
  out.data[0] = kilo_uid;
  out.data[1] = motion;
  out.crc = message_crc(&out);
  return &out;
}

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

static uint8_t is_lost(const struct neighbour* one) { return kilo_ticks - one->heard_at > FORGET_TICKS; }

/* Whether the robot behind lets this one go. The last robot of the chain never hears one behind. */
static uint8_t may_leave(void) {
  static uint8_t waits;
  if (WAIT == 0 || !behind.known) return 1;
  if (is_lost(&behind) || behind.distance_mm > WIDE_MM)
    waits = 1;
  else if (behind.distance_mm < OPEN_MM)
    waits = 0;
  return !waits && (WAIT == 1 || behind.stands);
}

/* Whether this robot is to approach the one ahead. */
static uint8_t wants_to_approach(void) {
  static uint8_t approaches;
  if (ahead.distance_mm <= CLOSE_MM) approaches = 0;
  if (ahead.distance_mm >= OPEN_MM) approaches = 1;
  return approaches && (WAIT < 2 || ahead.stands);
}

/* Changes legs when the approach on this leg is past its best. */
static void steer(void) {
  const int16_t nearer_mm = (int16_t)last_mm - ahead.distance_mm;
  const int16_t ticks = kilo_ticks - last_at;
  last_mm = ahead.distance_mm;
  last_at = kilo_ticks;
  if (motion == STOP) {
    best_rate = NO_RATE;
    tried = 0;
    return;
  }
  const int16_t rate = nearer_mm * (4 * INTERVAL_TICKS) / (ticks > 0 ? ticks : 1);
  if (rate > best_rate) best_rate = rate;
  if (best_rate >= 4 * GAIN_MM) tried = 0;
  if (tried || rate >= best_rate - 4 * MARGIN_MM) return;
  tried = best_rate < 4 * GAIN_MM;
  side = side == LEFT ? RIGHT : LEFT;
  best_rate = NO_RATE;
}

static void setup(void) {}

static void loop(void) {
  if (kilo_uid == LEADER) {
    set_color(RGB(3, 3, 3));
    move(may_leave() ? STRAIGHT : STOP);
    return;
  }
  if (!ahead.known || is_lost(&ahead)) {
    set_color(RGB(0, 0, 3));
    move(STOP);
    return;
  }
  if (ahead.fresh) {
    ahead.fresh = 0;
    steer();
  }
  const uint8_t approaches = wants_to_approach();
  set_color(approaches ? RGB(3, 3, 0) : RGB(0, 3, 0));
  move(approaches && may_leave() ? side : STOP);
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
