/* kilolib for simulated robots: the firmware's state machine, callbacks and functions over simulated hardware. */
#define KILOTWIN_RUNTIME
#include <avr/io.h>
#include <kilolib.h>
#include <stddef.h>
#include <util/delay.h>

#include "core/base/ir_calibration.h"
#include "image_abi.h"

enum { SLEEPING, IDLE, BATTERY, SETUP, RUNNING, CHARGING, MOVING };
enum { STAND, TURN_LEFT, TURN_RIGHT, STRAIGHT };
enum { CYCLES_PER_MS = 8000 };

/* Readings of the clock after which a tick has certainly passed for a program that does nothing else. */
enum { CLOCK_READS_PER_TICK = 4096 };

/* A charged battery: above 682, the firmware's own threshold for "full". */
enum { VOLTAGE_READING = 700 };
/* 25 degrees Celsius: 314 mV (data sheet of the ATmega328P, temperature sensor) of 1.1 V in 1024 steps. */
enum { TEMPERATURE_READING = 292 };
/* The middle of the range: no light is modelled. */
enum { LIGHT_READING = 512 };

void kt_enter(struct KtControl*);
void kt_wait(void);
uint64_t kt_call(struct KtControl*, uint64_t function, void* argument);
void kt_leave(void);
int main();
extern struct KtControl* kt_control;

static struct KtRobot robot = {.state = IDLE};

static void receive_nothing(message_t* message, distance_measurement_t* distance) {
  (void)message;
  (void)distance;
}
static message_t* send_nothing(void) { return NULL; }
static void note_nothing(void) {}

message_rx_t kilo_message_rx = receive_nothing;
message_tx_t kilo_message_tx = send_nothing;
message_tx_success_t kilo_message_tx_success = note_nothing;

volatile uint32_t kilo_ticks;
volatile uint16_t kilo_tx_period = 3906;
uint16_t kilo_uid;
uint8_t kilo_turn_left, kilo_turn_right, kilo_straight_left, kilo_straight_right;
uint16_t kilo_irhigh[KILOTWIN_IR_ENTRIES], kilo_irlow[KILOTWIN_IR_ENTRIES];

/* Known to programs that declare them themselves. */
message_t rx_msg;
distance_measurement_t rx_dist;
volatile uint8_t rx_busy;
volatile uint8_t tx_mask = 1;
uint16_t tx_clock, tx_increment = 255;

/* Time. */

static void wait_for_tick(void) {
  ++robot.waits;
  robot.clock_reads = 0;
  kt_wait();
}

/* Spends time: whole ticks at once, the rest when it has added up to one. A callback cannot wait: what it spends, the main
 * program waits for. */
static void spend(uint64_t cycles) {
  robot.debt_cycles += cycles;
  if (robot.in_interrupt) return;
  while (robot.debt_cycles >= robot.tick_cycles) {
    robot.debt_cycles -= robot.tick_cycles;
    wait_for_tick();
  }
}

/* For what the rest of the runtime lets a program wait for. */
void kilotwin_spend(unsigned long long cycles) { spend(cycles); }

void kilotwin_sleep(void) {
  if (!robot.in_interrupt) wait_for_tick();
}

volatile uint32_t* kilotwin_clock(void) {
  if (++robot.clock_reads > CLOCK_READS_PER_TICK && !robot.in_interrupt) wait_for_tick();
  return &kilo_ticks;
}

void delay(uint16_t ms) { spend((uint64_t)ms * CYCLES_PER_MS); }

void _delay_ms(double ms) {
  if (ms > 0) spend((uint64_t)((ms < 1e6 ? ms : 1e6) * CYCLES_PER_MS));
}

void _delay_us(double us) { _delay_ms(us / 1000); }

/* Motors, light, sensors. */

void set_motors(uint8_t left, uint8_t right) {
  robot.duty_left = left;
  robot.duty_right = right;
}

volatile uint8_t* kilotwin_motor_duty(uint8_t right) { return right ? &robot.duty_right : &robot.duty_left; }

/* The kick itself is the physics engine's: 15 ms at full duty within the tick for which the next duties hold. */
void spinup_motors(void) {
  delay(15);
  set_motors(255, 255);
  robot.spin_up = 1;
}

void set_color(uint8_t color) { robot.led = color & 63; }

int16_t get_ambientlight(void) { return LIGHT_READING; }
int16_t get_voltage(void) { return VOLTAGE_READING; }
int16_t get_temperature(void) { return TEMPERATURE_READING; }

/* SplitMix64, seeded by the host for each robot and each reset. */
uint8_t rand_hard(void) {
  uint64_t z = robot.noise += 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return (uint8_t)(z >> 56);
}

static uint8_t soft_seed = 0xaa, soft_count;

uint8_t rand_soft(void) {
  uint8_t s = soft_seed;
  s ^= (uint8_t)(s << 3);
  s ^= s >> 5;
  s ^= soft_count++ >> 2;
  return soft_seed = s;
}

void rand_seed(uint8_t seed) { soft_seed = seed; }

uint16_t message_crc(const message_t* message) {
  const uint8_t* octet = (const uint8_t*)message;
  uint16_t crc = 0xffff;
  for (int i = 0; i < 10; ++i) {
    uint8_t x = octet[i] ^ (uint8_t)crc;
    x ^= (uint8_t)(x << 4);
    crc = (uint16_t)(((uint16_t)x << 8 | crc >> 8) ^ (uint8_t)(x >> 4) ^ (uint16_t)x << 3);
  }
  return crc;
}

/* Millimetres beyond contact at entry `i` of a table, interpolated from the entry before. */
static uint8_t beyond_contact(const uint16_t* table, int i, int reading) {
  const int step = table[i] - table[i - 1];
  return step == 0 ? (uint8_t)(5 * i) : (uint8_t)((reading - table[i] + step * i) * 10 / (2 * step));
}

/* The first entry that lies below the reading, or `none`. */
static int first_below(const uint16_t* table, int reading, int none) {
  for (int i = 0; i < KILOTWIN_IR_ENTRIES; ++i) {
    if (reading > table[i]) return i;
  }
  return none;
}

uint8_t estimate_distance(const distance_measurement_t* distance) {
  enum { BOTH_FROM = 700, LOW_ONLY_FROM = 900, TOO_FAR = 90 };
  const int high = distance->high_gain, low = distance->low_gain;
  int by_high = 0, by_low = 0;
  if (high < LOW_ONLY_FROM) {
    const int i = first_below(kilo_irhigh, high, KILOTWIN_IR_ENTRIES - 1);
    by_high = i == 0 ? 0 : beyond_contact(kilo_irhigh, i, high);
  }
  if (high > BOTH_FROM) {
    const int i = first_below(kilo_irlow, low, -1);
    by_low = i < 0 ? TOO_FAR : i == 0 ? 0 : beyond_contact(kilo_irlow, i, low);
  }
  if (high <= BOTH_FROM) return (uint8_t)(KILOTWIN_IR_CONTACT_MM + by_high);
  if (high >= LOW_ONLY_FROM) return (uint8_t)(KILOTWIN_IR_CONTACT_MM + by_low);
  const int blend = by_high * (LOW_ONLY_FROM - high) + by_low * (high - BOTH_FROM);
  return (uint8_t)(KILOTWIN_IR_CONTACT_MM + blend / (LOW_ONLY_FROM - BOTH_FROM));
}

/* The state machine. */

void kilo_init(void) {
  static const uint16_t high[] = KILOTWIN_IR_HIGH, low[] = KILOTWIN_IR_LOW;
  for (int i = 0; i < KILOTWIN_IR_ENTRIES; ++i) {
    kilo_irhigh[i] = high[i];
    kilo_irlow[i] = low[i];
  }
  kilo_ticks = 0;
  kilo_tx_period = 3906;
  kilo_uid = robot.uid;
  kilo_turn_left = kilo_turn_right = robot.turn_duty;
  kilo_straight_left = kilo_straight_right = robot.straight_duty;
  robot.state = IDLE;
}

/* A whole tick goes by; what a delay has left over of it goes by with it. */
static void rest_of_tick(void) {
  robot.debt_cycles = 0;
  wait_for_tick();
}

static void park(void) {
  robot.parked = 1;
  rest_of_tick();
}

static void follow_calibration(void) {
  if (robot.motion == robot.motion_done) return;
  robot.motion_done = robot.motion;
  const uint8_t left = robot.motion == TURN_LEFT || robot.motion == STRAIGHT;
  const uint8_t right = robot.motion == TURN_RIGHT || robot.motion == STRAIGHT;
  if (left || right) {
    set_motors(left ? 255 : 0, right ? 255 : 0);
    delay(15);
  }
  switch (robot.motion) {
    case TURN_LEFT: set_motors(kilo_turn_left, 0); break;
    case TURN_RIGHT: set_motors(0, kilo_turn_right); break;
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    default: set_motors(0, 0);
  }
}

static void sleep_and_listen(void) {
  /* On a robot 10 ms; here what is heard in one tick is told in the one after. */
  enum { ASLEEP_MS = 8000, LISTENING_TICKS = 2 };
  robot.deaf = 1;
  delay(ASLEEP_MS);
  robot.deaf = 0;
  set_color(RGB(3, 3, 3));
  for (int i = 0; i < LISTENING_TICKS; ++i) rest_of_tick();
  set_color(0);
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
  uint8_t has_setup = 0;
  for (;;) {
    spend(0);
    switch (robot.state) {
      case SLEEPING: sleep_and_listen(); break;
      case BATTERY:
        set_color(VOLTAGE_READING > 682 ? RGB(0, 3, 0) : RGB(3, 0, 0));
        park();
        break;
      case SETUP:
        if (!has_setup) {
          has_setup = 1;
          setup();
        }
        robot.state = RUNNING;
        /* fall through */
      case RUNNING: {
        /* Once per tick. If loop() itself waited, it is due again in the tick in which the wait has ended. */
        const uint64_t waits = robot.waits;
        loop();
        if (waits == robot.waits) rest_of_tick();
        break;
      }
      case MOVING:
        follow_calibration();
        rest_of_tick();
        break;
      default: /* IDLE, CHARGING */ set_color(0); park();
    }
  }
}

/* The program has ended: on a robot it spins for ever with interrupts off. */
_Noreturn void kilotwin_end(void) {
  robot.deaf = 1;
  for (;;) park();
}

/* Constructors of a C++ program's globals; the linker makes the ends. */
extern void (*__init_array_start[])(void) __attribute__((weak, visibility("hidden")));
extern void (*__init_array_end[])(void) __attribute__((weak, visibility("hidden")));

static void boot(void) {
  for (void (**construct)(void) = __init_array_start; construct < __init_array_end; ++construct) (*construct)();
  main();
  kilotwin_end();
}

/* Messages of the overhead controller. */

static void motors_on(void) { robot.motors_on = 1; }
static void motors_off(void) { robot.motors_on = 0; }

static void start_motion(uint8_t motion, uint8_t changed) {
  if (robot.motion != motion || changed) {
    robot.motion_done = STAND;
    robot.motion = motion;
  }
}

static void calibrate(const calibmsg_t* wish) {
  switch (wish->mode) {
    case CALIB_SAVE:
      if (robot.state == MOVING) {
        motors_off();
        robot.state = IDLE;
      }
      return;
    case CALIB_UID:
      kilo_uid = wish->uid;
      robot.motion = STAND;
      break;
    case CALIB_TURN_LEFT:
      start_motion(TURN_LEFT, kilo_turn_left != wish->turn_left);
      kilo_turn_left = wish->turn_left;
      break;
    case CALIB_TURN_RIGHT:
      start_motion(TURN_RIGHT, kilo_turn_right != wish->turn_right);
      kilo_turn_right = wish->turn_right;
      break;
    case CALIB_STRAIGHT:
      start_motion(STRAIGHT,
                   kilo_straight_left != wish->straight_left || kilo_straight_right != wish->straight_right);
      kilo_straight_left = wish->straight_left;
      kilo_straight_right = wish->straight_right;
      break;
  }
  if (robot.state != MOVING) {
    motors_on();
    robot.state = MOVING;
  }
}

static void obey(const message_t* message) {
  robot.parked = 0;
  if (message->type != READUID && message->type != RUN && message->type != CALIB) motors_off();
  switch (message->type) {
    case BOOT:
      robot.bootloader = 1;
      robot.state = IDLE;
      robot.led = 0;
      break;
    case RESET: robot.reset = 1; break;
    case SLEEP: robot.state = SLEEPING; break;
    case WAKEUP: robot.state = IDLE; break;
    case CHARGE: robot.state = CHARGING; break;
    case VOLTAGE: robot.state = BATTERY; break;
    case RUN:
      if (robot.state != SETUP && robot.state != RUNNING) {
        motors_on();
        robot.state = SETUP;
      }
      break;
    case CALIB: calibrate((const calibmsg_t*)message->data); break;
    case READUID:
      if (robot.state != MOVING) {
        motors_on();
        set_color(0);
        robot.motion = robot.motion_done = STAND;
        robot.state = MOVING;
      }
      robot.motion = message->data[0] < 16 && (kilo_uid >> message->data[0] & 1) ? TURN_LEFT : STAND;
      break;
    default: break;
  }
  if (robot.bootloader) robot.parked = 1;
}

/* The boot loader keeps the program away until it hears anything but its own kind of message; then the robot restarts. */
static void boot_loader(uint8_t type) {
  if (type < BOOT || type > BOOTPGM_SIZE) robot.reset = 1;
}

/* What is received after a RESET in the same tick is lost while the robot starts. */
static uint64_t interrupts(const struct KtEvents* events) {
  robot.in_interrupt = 1;
  if (events->sent) kilo_message_tx_success();
  for (uint32_t i = 0; i < events->receptions && !robot.reset && !robot.deaf; ++i) {
    const struct KtReception* reception = &events->reception[i];
    __builtin_memcpy(&rx_msg, &reception->message, sizeof rx_msg);
    rx_dist.low_gain = reception->low_gain;
    rx_dist.high_gain = reception->high_gain;
    if (robot.bootloader)
      boot_loader(rx_msg.type);
    else if (rx_msg.type < BOOT)
      kilo_message_rx(&rx_msg, &rx_dist);
    else
      obey(&rx_msg);
  }
  robot.in_interrupt = 0;
  return 0;
}

static uint64_t transmit(struct KtMessage* out) {
  if (robot.state != RUNNING) return 0;
  robot.in_interrupt = 1;
  const message_t* message = kilo_message_tx();
  robot.in_interrupt = 0;
  if (message == NULL) return 0;
  __builtin_memcpy(out, message, sizeof *out);
  return 1;
}

__attribute__((visibility("default"), used)) const struct KtImage kilotwin_image = {
    KT_IMAGE_MAGIC,        KT_IMAGE_VERSION,          (uint64_t)&kt_control, (uint64_t)&robot,
    (uint64_t)&kilo_ticks, (uint64_t)&kilo_tx_period, (uint64_t)&boot,       (uint64_t)&kt_enter,
    (uint64_t)&kt_call,    (uint64_t)&kt_leave,       (uint64_t)&interrupts, (uint64_t)&transmit,
};
