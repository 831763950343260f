/* The random walk of robots on a Kilogrid (experiments/kilogrid.txtpb): straight on for |N(15, 1.5)| s, then a turn of
 * |N(0.5, 3)| s to either side, both in whole seconds. Robots also turn away from walls. On the real floor, cells on the rim send
 * wall messages, some of which arrive. Here the cells emit light instead, which grows towards the middle of a cell. A robot that
 * notices a wall turns, and changes its side every 7.5 s. It goes straight when four readings in a row are weaker than the four
 * before. After one second without a reading it continues the walk with the next step.
 * LED: green straight on, blue to the left, red to the right; brighter beside a wall. */
#include <kilolib.h>

#ifndef WALL_RANGE_MM
#define WALL_RANGE_MM 42 /* range from the middle of a rim cell within which robots notice it */
#endif
#ifndef WALL_HEARD
#define WALL_HEARD 20 /* number of its messages that arrive in 10 s */
#endif
/* The floor's light: 1000 counts in the middle of a rim cell, 10 less for each mm of distance. */
#define NOTICED (1000 - 10 * WALL_RANGE_MM)

/* Periods of the walk and of the wall avoidance, in kilo_ticks. */
#define WALK_TICKS 31
#define WALL_TICKS 32
#define LISTEN_TICKS 4
/* Probability that a message arrives in that time, in 256ths: 0.131 s is 859 / 65536 of 10 s. */
#define HEARD (WALL_HEARD * 859L / 256)
#define LONGEST_TURN_TICKS (7500 / 32)
#define READINGS 4

enum motion { STOP, STRAIGHT, LEFT, RIGHT };
static enum { BEGIN, GO, TURN } walk_state = BEGIN;
static enum { LOOK, ROTATE, ESCAPE } avoid_state = LOOK;
static enum motion motion = STOP;
static uint8_t avoiding, new_reading, readings;
static uint32_t walk_until, wall_until, turn_until, listen_at;
static uint16_t sum, reading, previous;

static void move(enum motion next) {
  if (next == motion) return;
  motion = next;
  spinup_motors();
  if (next == STRAIGHT) {
    set_color(RGB(0, 1, 0));
    set_motors(kilo_straight_left, kilo_straight_right);
  } else if (next == LEFT) {
    set_color(RGB(0, 0, 1));
    set_motors(kilo_turn_left, 0);
  } else {
    set_color(RGB(1, 0, 0));
    set_motors(0, kilo_turn_right);
  }
}

static enum motion either_side(void) { return rand_soft() & 0x80 ? LEFT : RIGHT; }

/* An approximately normal number with mean 0, in 1/256 of the standard deviation: the sum of twelve uniform numbers. */
static int16_t normal(void) {
  int16_t n = -6 * 255;
  uint8_t i;
  for (i = 0; i < 12; ++i) n += rand_soft();
  return n;
}

/* |mean + sd n| in whole seconds; mean and sd are in 1/256 s. */
static uint32_t draw(int32_t mean, int32_t sd) {
  int32_t time = mean + sd * normal() / 256;
  if (time < 0) time = -time;
  return (uint32_t)(time / 256) * WALK_TICKS;
}

static void forget_readings(void) {
  readings = 0;
  sum = reading = previous = 0;
}

static void listen(void) {
  int16_t light;
  if (kilo_ticks < listen_at) return;
  listen_at = kilo_ticks + LISTEN_TICKS;
  light = get_ambientlight();
  if (light < NOTICED || rand_soft() >= HEARD) return;
  avoiding = 1;
  wall_until = kilo_ticks + WALL_TICKS;
  sum += (uint16_t)light;
  if (++readings < READINGS) return;
  previous = reading;
  reading = sum;
  readings = 0;
  sum = 0;
  new_reading = 1;
}

static void walk(void) {
  switch (walk_state) {
    case BEGIN:
      walk_until = kilo_ticks + draw(15 * 256L, 384);
      move(STRAIGHT);
      walk_state = GO;
      break;
    case GO:
      if (kilo_ticks <= walk_until) break;
      walk_until = kilo_ticks + draw(128, 3 * 256L);
      move(either_side());
      walk_state = TURN;
      break;
    case TURN:
      if (kilo_ticks > walk_until) walk_state = BEGIN;
      break;
  }
}

static void avoid(void) {
  if (kilo_ticks > wall_until) {
    avoid_state = LOOK;
    avoiding = 0;
    return;
  }
  switch (avoid_state) {
    case LOOK:
      move(either_side());
      forget_readings();
      turn_until = kilo_ticks + LONGEST_TURN_TICKS;
      avoid_state = ROTATE;
      break;
    case ROTATE:
      if (kilo_ticks > turn_until) {
        turn_until = kilo_ticks + LONGEST_TURN_TICKS;
        move(motion == LEFT ? RIGHT : LEFT);
        forget_readings();
      }
      if (!new_reading) break;
      new_reading = 0;
      if (previous > reading) {
        move(STRAIGHT);
        avoid_state = ESCAPE;
      }
      break;
    case ESCAPE:
      if (!new_reading) break;
      new_reading = 0;
      if (previous < reading) avoid_state = LOOK;
      break;
  }
}

static void setup(void) {
  rand_seed(rand_hard());
  listen_at = rand_soft() % LISTEN_TICKS;
}

static void loop(void) {
  listen();
  if (avoiding)
    avoid();
  else
    walk();
}

int main(void) {
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}
