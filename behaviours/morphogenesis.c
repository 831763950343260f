/* Morphogenesis: robots that stand side by side form spots, as a reaction and diffusion of two substances do (Turing 1952, on a
 * network: Nakao and Mikhailov 2010). Each robot holds an activator and an inhibitor and sends both. Both flow between neighbours.
 * The activator makes more of both; the inhibitor removes both and flows faster. Only then do spots grow out of chance: with
 * --define INHIBITOR_FLOW=ACTIVATOR_FLOW all robots stay alike.
 * LED: green with much activator, yellow between, blue with little. */
#include <kilolib.h>

#ifndef ACTIVATOR_FLOW
#define ACTIVATOR_FLOW 1.0f
#endif
#ifndef INHIBITOR_FLOW
#define INHIBITOR_FLOW 8.0f
#endif
#define STEP 0.1f     /* units of time per reaction */
#define STEP_TICKS 16 /* half a second */
#define NEIGHBOURS 16
#define FORGET_TICKS (6 * TICKS_PER_SEC)
#define SCALE 100 /* amounts, -1..1, as numbers of eight bits */

static struct {
  uint16_t id;
  int8_t activator, inhibitor;
  uint32_t heard_at;
} neighbours[NEIGHBOURS];
static uint8_t count;
static message_t out;
static float activator, inhibitor;
static uint32_t next_at;

static void receive(message_t* message, distance_measurement_t* strength) {
  (void)strength;
  if (message->type != NORMAL) return;
  const uint16_t id = message->data[0] | (uint16_t)message->data[1] << 8;
  uint8_t i = 0;
  while (i < count && neighbours[i].id != id) ++i;
  if (i == NEIGHBOURS) return;
  if (i == count) ++count;
  neighbours[i].id = id;
  neighbours[i].activator = (int8_t)message->data[2];
  neighbours[i].inhibitor = (int8_t)message->data[3];
  neighbours[i].heard_at = kilo_ticks;
}

static message_t* send(void) {
  out.type = NORMAL;
  out.data[0] = kilo_uid & 0xff;
  out.data[1] = kilo_uid >> 8;
  out.data[2] = (uint8_t)(int8_t)(activator * SCALE);
  out.data[3] = (uint8_t)(int8_t)(inhibitor * SCALE);
  out.crc = message_crc(&out);
  return &out;
}

static float limited(float amount) { return amount > 1 ? 1 : amount < -1 ? -1 : amount; }

static void react(void) {
  int16_t activators = 0, inhibitors = 0;
  uint8_t heard = 0;
  for (uint8_t i = 0; i < count; ++i) {
    if (kilo_ticks - neighbours[i].heard_at > FORGET_TICKS) continue;
    activators += neighbours[i].activator;
    inhibitors += neighbours[i].inhibitor;
    ++heard;
  }
  float activator_gain = activator - inhibitor, inhibitor_gain = 1.5f * activator - 1.2f * inhibitor;
  if (heard > 0) {
    activator_gain += ACTIVATOR_FLOW * ((float)activators / heard / SCALE - activator);
    inhibitor_gain += INHIBITOR_FLOW * ((float)inhibitors / heard / SCALE - inhibitor);
  }
  activator = limited(activator + STEP * activator_gain);
  inhibitor = limited(inhibitor + STEP * inhibitor_gain);
}

static void setup(void) {
  activator = ((float)rand_hard() - 127.5f) / 127.5f / 4;
  next_at = kilo_ticks + rand_hard() % STEP_TICKS;
}

static void loop(void) {
  if (kilo_ticks < next_at) return;
  next_at = kilo_ticks + STEP_TICKS;
  react();
  set_color(activator > 0.5f ? RGB(0, 3, 0) : activator > -0.5f ? RGB(3, 3, 0) : RGB(0, 0, 3));
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_message_tx = send;
  kilo_start(setup, loop);
  return 0;
}
