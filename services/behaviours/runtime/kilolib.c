/* kilolib for simulated robots: the firmware's state machine, callbacks and functions on simulated hardware. */
#define KILOTWIN_RUNTIME
#include <avr/io.h>
#include <kilolib.h>
#include <stddef.h>
#include <util/delay.h>

#include "budget.h"
#include "core/base/eeprom_layout.h"
#include "core/base/message_crc.h"
#include "core/math/elementary.h"
#include "image_abi.h"

enum { SLEEPING, IDLE, BATTERY, SETUP, RUNNING, CHARGING, MOVING };
enum { STAND, TURN_LEFT, TURN_RIGHT, STRAIGHT };
enum { CYCLES_PER_MS = 8000 };

/* Duration of calls. A conversion takes 13 clocks of the ADC: 1 MHz, for the temperature 62.5 kHz. BUSY: the ADC is in use. */
enum {
  READING_CYCLES = 150,
  TEMPERATURE_CYCLES = 1720,
  BUSY_CYCLES = 20,
  RAND_HARD_CYCLES = 8 * 2 * 2 * READING_CYCLES
};
enum { PACKET_CYCLES = 13 * 10 * 269 };
enum { HIGHEST_READING = 1023 };

uint64_t kt_enter(void);
uint64_t kt_call(uint64_t function);
void kt_leave(void);
int main();
extern struct KtExchange* kt_exchange;

/* Read-only after the loader has set it. */
__attribute__((section(".data.rel.ro.kilotwin"), used)) struct KtSurroundings* kt_surroundings = 0;

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

/* Variables of kilolib that some programs declare extern. */
message_t rx_msg;
distance_measurement_t rx_dist;
volatile uint8_t rx_busy;
volatile uint8_t tx_mask = 1;
uint16_t tx_clock, tx_increment = 255;

/* Time. */

/* Waits for the next tick. It jumps and does not call; see switch.c. */
#define IN_LINE static inline __attribute__((always_inline))
IN_LINE void return_to_host(void) {
  __asm__ volatile("lea 1f(%%rip), %%rax\n\tpush %%rax\n\tjmp kt_wait\n1:"
                   :
                   :
                   : "rax", "rcx", "rdx", "rsi", "rdi", "r8", "r9", "r10", "r11", "xmm0", "xmm1", "xmm2", "xmm3",
                     "xmm4", "xmm5", "xmm6", "xmm7", "xmm8", "xmm9", "xmm10", "xmm11", "xmm12", "xmm13", "xmm14",
                     "xmm15", "memory", "cc");
}

IN_LINE void wait_for_tick(void) {
  ++robot.waits;
  return_to_host();
}

enum { MOST_AT_ONCE = 1 << 30 };

static int32_t cycles_held(void) {
  int32_t held;
  __asm__ volatile("movl %%gs:%c1, %0" : "=r"(held) : "i"(KT_THREAD_HELD));
  return held;
}

/* Cycles of the library's functions on the robot: this project's kilolib for the AVR as avr-gcc 5.4 compiles it. Its code here is
 * not counted by itself. LOOP: from one return of loop() to the next call. */
enum {
  LOOP_CYCLES = 20,
  SET_MOTORS_CYCLES = 8,
  SET_COLOR_CYCLES = 26,
  RAND_SOFT_CYCLES = 26,
  MESSAGE_CRC_CYCLES = 390,
  ESTIMATE_DISTANCE_CYCLES = 800
};

/* Number of this tick's messages whose callbacks have begun, of how many, and what is known of their times. */
static struct {
  uint32_t index, count, drawn;
  uint32_t cycle; /* at which message drawn - 1 ended */
} arrivals;

static uint64_t noise(void);

/* Cycle of the tick at which the message that is being received ended. The times of a tick's messages are random; their order
 * is known. So the next one is the first of as many random times as messages are left. */
static uint32_t arrival(void) {
  for (; arrivals.drawn <= arrivals.index; ++arrivals.drawn) {
    const uint32_t rest = robot.tick_cycles - arrivals.cycle;
    uint64_t first = rest;
    for (uint32_t left = arrivals.count - arrivals.drawn; left > 0; --left) {
      const uint64_t one = rest == 0 ? 0 : (noise() >> 11) % rest;
      if (one < first) first = one;
    }
    arrivals.cycle += (uint32_t)first;
  }
  return arrivals.cycle;
}

/* Notes that interrupts are off for this long, in which every message is lost: hears(). Messages of a tick are heard at the
 * beginning of the next one. So a callback blocks those that follow in the same tick, the main program those of the next. */
static void block(uint64_t cycles) {
  enum { MOST = 65535 };
  const uint16_t at = (uint16_t)(kilo_ticks + (robot.in_interrupt ? 0 : 1));
  uint64_t start = robot.blocked_at == at ? (uint64_t)robot.blocked * KT_BLOCKED_UNIT : 0;
  if (robot.in_interrupt == KT_IN_RX && arrival() > start) start = arrival();
  const uint64_t end = (start + cycles + KT_BLOCKED_UNIT - 1) / KT_BLOCKED_UNIT;
  robot.blocked_at = at;
  robot.blocked = (uint16_t)(end < MOST ? end : MOST);
}

/* Lets the main program wait for `cycles`. With KT_LOOP_PER_TICK it waits for whole ticks; remainders add up. A callback cannot
 * wait, so the main program waits for it. With KT_LOOP_AS_ON_ROBOT the cycles reduce the tick's budget, as code does. */
static void spend(uint64_t cycles) {
  if (cycles != 0) robot.spent = 1;
  if (robot.loop_rate == KT_LOOP_AS_ON_ROBOT && !robot.in_interrupt) {
    while (cycles > 0) {
      const int32_t part = cycles < MOST_AT_ONCE ? (int32_t)cycles : MOST_AT_ONCE;
      set_cycles_left(cycles_left() - part);
      /* Below 0 the loop's test returns to the host, which continues here when the budget is positive again. */
      while (cycles_left() < 0) {}
      cycles -= (uint64_t)part;
    }
    return;
  }
  robot.debt_cycles += cycles;
  if (robot.in_interrupt) {
    /* A reading is over before the next message can have begun: only longer waits lose messages. */
    if (cycles >= PACKET_CYCLES / 4) block(cycles);
    return;
  }
  while (robot.debt_cycles >= robot.tick_cycles) {
    robot.debt_cycles -= robot.tick_cycles;
    wait_for_tick();
  }
}

/* For malloc(). */
uint32_t* kt_heap_octets(void) { return &robot.heap_octets; }
void kt_heap_full(const void* caller) { kt_exchange->heap_full = (uint64_t)caller; }

/* For delays in the rest of the runtime. */
void kilotwin_spend(unsigned long long cycles) { spend(cycles); }

void kilotwin_sleep(void) {
  if (!robot.in_interrupt) wait_for_tick();
}

void delay(uint16_t ms) { spend((uint64_t)ms * CYCLES_PER_MS); }

void _delay_ms(double ms) {
  if (ms > 0) spend((uint64_t)((ms < 1e6 ? ms : 1e6) * CYCLES_PER_MS));
}

void _delay_us(double us) { _delay_ms(us / 1000); }

/* Motors, light, sensors. */

/* Cycles since the beginning of the tick. Callbacks run at its beginning. */
static uint32_t cycle_of_tick(void) {
  if (robot.in_interrupt) return 0;
  if (robot.loop_rate == KT_LOOP_PER_TICK) return (uint32_t)robot.debt_cycles;
  const int32_t now = (int32_t)robot.tick_cycles - cycles_left() - cycles_held();
  return now > 0 ? (uint32_t)now : 0;
}

enum { FULL_DUTY = 255 };

/* The duties are about to change. A call of loop() that changes them is not skipped, even if it restores them. In callbacks after
 * the program's own time, cycle_of_tick() is 0: what was counted stays counted. */
static void note_duties(void) {
  struct KilotwinMotorPhases* motors = &kt_surroundings->motors;
  const uint32_t cycle = cycle_of_tick(), now = cycle > motors->from ? cycle : motors->from;
  /* The loop within must not end the tick: the phases are not part of the robot's memory, so another robot would find its rest. */
  const int32_t left = cycles_left();
  set_cycles_left(INT32_MAX);
  kilotwin_add_motors(motors, robot.duty_left, robot.duty_right, now - motors->from);
  set_cycles_left(left);
  motors->from = now;
  robot.spent = 1;
}

void set_motors(uint8_t left, uint8_t right) {
  charge(SET_MOTORS_CYCLES);
  const uint8_t full = left == FULL_DUTY && right == FULL_DUTY;
  if (full != robot.full) {
    const uint32_t now = cycle_of_tick();
    if (full) {
      robot.full_from = now;
      robot.before_left = robot.duty_left;
      robot.before_right = robot.duty_right;
    } else if (now > robot.full_from) {
      robot.full_cycles += now - robot.full_from;
    }
    robot.full = full;
  }
  if (left != robot.duty_left || right != robot.duty_right) note_duties();
  robot.duty_left = left;
  robot.duty_right = right;
}

/* A write may follow. */
volatile uint8_t* kilotwin_motor_duty(uint8_t right) {
  note_duties();
  return right ? &robot.duty_right : &robot.duty_left;
}

void spinup_motors(void) {
  set_motors(FULL_DUTY, FULL_DUTY);
  delay(15);
}

/* A time of this tick, cycles. Random, but draws nothing from the generator. */
static uint32_t sample_cycle(void) {
  const uint64_t z = (robot.noise ^ kilo_ticks) * 0xbf58476d1ce4e5b9u;
  return (uint32_t)(((z ^ z >> 31) * 0x94d049bb133111ebu >> 32) % robot.tick_cycles);
}

void set_color(uint8_t color) {
  charge(SET_COLOR_CYCLES);
  color &= 63;
  if (color == robot.led) return;
  struct KtSurroundings* around = kt_surroundings;
  if (around->led_changes <= KT_MOST_FLASHES) {
    if (around->led_changes++ == 0) around->led_sampled = robot.led;
    if (cycle_of_tick() <= sample_cycle()) around->led_sampled = color;
    /* Calls that change the LED are not skipped until it is known to flicker: which ones are executed must not matter. */
    ++robot.effects;
  }
  robot.led = color;
}

/* The EEPROM of an ATmega328P, 1024 octets. */
uint8_t* kt_eeprom(void) {
  struct KtSurroundings* around = kt_surroundings;
  if (around->eeprom != NULL) return around->eeprom;
  if (!around->eeprom_filled) {
    const struct KilotwinCalibration own = {robot.uid, robot.turn_left, robot.turn_right, robot.straight_left,
                                            robot.straight_right};
    kilotwin_fill_eeprom(around->eeprom_copy, own);
    around->eeprom_filled = 1;
  }
  return around->eeprom_copy;
}

void kt_write_eeprom(uint16_t address, uint8_t value) {
  uint8_t* cell = kt_eeprom() + address;
  if (*cell != value) ++robot.effects;
  *cell = value;
  kt_surroundings->eeprom_written = 1;
}

/* SplitMix64, seeded by the host for each robot and each reset. */
static uint64_t noise(void) {
  uint64_t z = robot.noise += 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z;
}

/* Whether the ADC is measuring a message. Receptions occupy one interval of the tick with a random start, which wraps around at
 * the end of the tick. Callbacks run after a message is complete, when the ADC is free. */
static uint8_t is_receiving(void) {
  struct KtSurroundings* around = kt_surroundings;
  if (around->receiving_cycles == 0 || robot.in_interrupt) return 0;
  if (around->receiving_from == 0) around->receiving_from = 1 + (noise() >> 11) % robot.tick_cycles;
  const int64_t within = robot.loop_rate == KT_LOOP_AS_ON_ROBOT
                             ? (int64_t)robot.tick_cycles - cycles_left() - cycles_held()
                             : (int64_t)robot.debt_cycles;
  const uint64_t now = (uint64_t)within % robot.tick_cycles + robot.tick_cycles + 1;
  return (now - around->receiving_from) % robot.tick_cycles < around->receiving_cycles;
}

/* An ADC reading with this mean and standard deviation. The computation costs the robot no cycles. */
static int16_t convert(double expected, double sd) {
  const int32_t left = cycles_left();
  set_cycles_left(INT32_MAX);
  if (sd > 0) expected += sd * kt_inverse_normal(((double)(noise() >> 12) + 0.5) * 0x1p-52);
  expected = kt_floor(expected + 0.5);
  set_cycles_left(left);
  return (int16_t)(expected < 0 ? 0 : expected > HIGHEST_READING ? HIGHEST_READING : expected);
}

static int16_t reading(double expected, double sd, uint64_t cycles) {
  if (is_receiving()) {
    ++robot
          .effects; /* a loop that waits for the ADC ends without an interrupt, so it must not count as a busy wait */
    spend(BUSY_CYCLES);
    return -1;
  }
  spend(cycles);
  robot.trigger_lost = 0;
  return robot.adc = convert(expected, sd);
}

int16_t get_ambientlight(void) {
  return reading(kt_surroundings->light, kt_surroundings->light_sd, READING_CYCLES);
}

int16_t get_temperature(void) {
  return reading(kt_surroundings->temperature, kt_surroundings->temperature_sd, TEMPERATURE_CYCLES);
}

/* As in the firmware, this leaves the ADC on the battery's channel. The next message's high-gain strength is then this reading. */
int16_t get_voltage(void) {
  const int16_t voltage = reading(kt_surroundings->voltage, kt_surroundings->voltage_sd, READING_CYCLES);
  if (voltage >= 0) robot.trigger_lost = 1;
  return voltage;
}

/* The firmware takes each bit from a pair of voltage readings whose lowest bits differ, which is a fair bit if readings are
 * independent. Without noise the readings never differ, and all bits are equal. */
uint8_t rand_hard(void) {
  block(RAND_HARD_CYCLES);
  spend(RAND_HARD_CYCLES);
  robot.trigger_lost = 0;
  if (!(kt_surroundings->voltage_sd > 0)) return convert(kt_surroundings->voltage, 0) & 1 ? 255 : 0;
  return (uint8_t)(noise() >> 56);
}

static uint8_t soft_seed = 0xaa, soft_count;

uint8_t rand_soft(void) {
  charge(RAND_SOFT_CYCLES);
  uint8_t s = soft_seed;
  s ^= (uint8_t)(s << 3);
  s ^= s >> 5;
  s ^= soft_count++ >> 2;
  return soft_seed = s;
}

void rand_seed(uint8_t seed) { soft_seed = seed; }

uint16_t message_crc(const message_t* message) {
  charge(MESSAGE_CRC_CYCLES);
  return kilotwin_message_crc((const uint8_t*)message);
}

/* Distance beyond contact, mm, for a reading between entries i - 1 and i of a table; linear interpolation. */
static uint8_t beyond_contact(const uint16_t* table, int i, int reading) {
  const int step = table[i] - table[i - 1];
  return step == 0 ? (uint8_t)(5 * i) : (uint8_t)((reading - table[i] + step * i) * 10 / (2 * step));
}

/* Index of the first entry below the reading, or `none`. */
static int first_below(const uint16_t* table, int reading, int none) {
  /* Without a loop it needs no tests of the budget. */
#pragma GCC unroll 16
  for (int i = 0; i < KILOTWIN_IR_ENTRIES; ++i) {
    if (reading > table[i]) return i;
  }
  return none;
}

uint8_t estimate_distance(const distance_measurement_t* distance) {
  charge(ESTIMATE_DISTANCE_CYCLES);
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

void kilotwin_overflow(void) {
  struct KtExchange* told = kt_exchange;
  if (told->overflows < KT_MOST_OVERFLOWS)
    told->overflow[told->overflows++] = (uint64_t)__builtin_return_address(0);
}

/* The state machine. */

static uint16_t high_octet_first(const uint8_t* octet) { return (uint16_t)(octet[0] << 8 | octet[1]); }

void kilo_init(void) {
  enum { TX_PINS = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 6 | 1 << 7 };
  const uint8_t* eeprom = kt_eeprom();
  tx_mask = eeprom[KILOTWIN_EEPROM_TX_MASK];
  if (tx_mask & ~TX_PINS) tx_mask = 1 << 0;
  kilo_ticks = 0;
  kilo_tx_period = 3906;
  kilo_uid = (uint16_t)(eeprom[KILOTWIN_EEPROM_UID] | eeprom[KILOTWIN_EEPROM_UID + 1] << 8);
  kilo_turn_left = eeprom[KILOTWIN_EEPROM_TURN_LEFT];
  kilo_turn_right = eeprom[KILOTWIN_EEPROM_TURN_RIGHT];
  kilo_straight_left = eeprom[KILOTWIN_EEPROM_STRAIGHT_LEFT];
  kilo_straight_right = eeprom[KILOTWIN_EEPROM_STRAIGHT_RIGHT];
  for (int i = 0; i < KILOTWIN_IR_ENTRIES; ++i) {
    kilo_irlow[i] = high_octet_first(eeprom + KILOTWIN_EEPROM_IR_LOW + 2 * i);
    kilo_irhigh[i] = high_octet_first(eeprom + KILOTWIN_EEPROM_IR_HIGH + 2 * i);
  }
  robot.motors_on = robot.duty_left = robot.duty_right = 0;
  robot.state = IDLE;
}

/* Waits for the end of the tick. The remainder of a delay is dropped. */
IN_LINE void rest_of_tick(void) {
  robot.debt_cycles = 0;
  wait_for_tick();
}

static void park(void) {
  robot.parked = 1;
  rest_of_tick();
}

static void follow_calibration(void) {
  if (robot.motion == STAND) set_motors(0, 0);
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
  /* A robot listens for 10 ms. Here callbacks for a tick's messages run in the next tick, so it listens for two. A robot that
   * hears a message keeps listening for LISTENING_ON_MS. */
  enum { ASLEEP_MS = 8000, LISTENING_TICKS = 2, LISTENING_ON_MS = 100 };
  set_color(0);
  robot.deaf = 1;
  delay(ASLEEP_MS);
  robot.deaf = robot.heard = 0;
  set_color(RGB(3, 3, 3));
  for (int i = 0; i < LISTENING_TICKS; ++i) rest_of_tick();
  if (robot.heard) {
    set_color(RGB(3, 0, 0));
    delay(LISTENING_ON_MS);
  }
  set_color(0);
}

static void show_charge(void) {
  const int16_t voltage = get_voltage();
  set_color(voltage > 682   ? RGB(0, 3, 0)
            : voltage > 648 ? RGB(0, 0, 3)
            : voltage > 614 ? RGB(3, 3, 0)
                            : RGB(3, 0, 0));
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
  uint8_t has_setup = 0;
  for (;;) {
    spend(0);
    switch (robot.state) {
      case SLEEPING: sleep_and_listen(); break;
      case BATTERY:
        show_charge();
        rest_of_tick();
        break;
      case SETUP:
        if (!has_setup) {
          has_setup = 1;
          setup();
        }
        robot.state = RUNNING;
        /* fall through */
      case RUNNING: {
        if (robot.loop_rate == KT_LOOP_AS_ON_ROBOT) {
          charge(LOOP_CYCLES);
          loop();
          /* Written since the host has looked at the state, with all that led to this call. */
          const uint8_t written = has_written();
          if (--robot.calls == 0) {
            robot.returned = (uint8_t)(KT_RETURNED_UNCHANGED - written);
            return_to_host();
            watch_writes();
          }
          break;
        }
        /* Once per tick. If loop() itself waited, it is called again in the tick in which its wait ended. */
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

/* The end of main(). On a robot avr-libc then loops for ever with interrupts disabled. */
_Noreturn void kilotwin_end(void) {
  robot.deaf = 1;
  kt_exchange->ended = 1;
  for (;;) park();
}

/* Constructors of a C++ program's globals; constructors.ld defines the two symbols. */
extern void (*__init_array_start[])(void) __attribute__((weak, visibility("hidden")));
extern void (*__init_array_end[])(void) __attribute__((weak, visibility("hidden")));

static void boot(void) {
  for (void (**construct)(void) = __init_array_start; construct < __init_array_end; ++construct) (*construct)();
  main();
  kilotwin_end();
}

/* Messages of the overhead controller. */

static void connect_motors(uint8_t on) {
  robot.motors_on = on;
  set_motors(0, 0);
}
static void motors_on(void) { connect_motors(1); }
static void motors_off(void) { connect_motors(0); }

static void save_calibration(void) {
  kt_write_eeprom(KILOTWIN_EEPROM_UID, (uint8_t)kilo_uid);
  kt_write_eeprom(KILOTWIN_EEPROM_UID + 1, (uint8_t)(kilo_uid >> 8));
  kt_write_eeprom(KILOTWIN_EEPROM_TURN_LEFT, kilo_turn_left);
  kt_write_eeprom(KILOTWIN_EEPROM_TURN_RIGHT, kilo_turn_right);
  kt_write_eeprom(KILOTWIN_EEPROM_STRAIGHT_LEFT, kilo_straight_left);
  kt_write_eeprom(KILOTWIN_EEPROM_STRAIGHT_RIGHT, kilo_straight_right);
}

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
        save_calibration();
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

/* In the boot loader the program does not run. Any message that is not for the boot loader restarts the robot. */
static void boot_loader(uint8_t type) {
  if (type < BOOT || type > BOOTPGM_SIZE) robot.reset = 1;
}

/* Whether the message that is being received is heard. One that overlaps a time with interrupts off is lost: its bits are taken
 * late. The overhead controller repeats its commands until one is heard. */
static uint8_t hears(uint8_t type) {
  if (robot.blocked == 0 || type >= BOOT) return 1;
  const uint16_t after = (uint16_t)((uint16_t)kilo_ticks - robot.blocked_at);
  const uint16_t since = after == 0xffff ? 0 : after; /* a tick in which the robot's clock did not advance */
  const int64_t end = (int64_t)robot.blocked * KT_BLOCKED_UNIT - (int64_t)since * robot.tick_cycles;
  if (end + PACKET_CYCLES <= 0) {
    robot.blocked = 0;
    return 1;
  }
  return (int64_t)arrival() >= end + PACKET_CYCLES;
}

/* Messages after a RESET in the same tick are lost, because the robot is starting. */
static uint64_t interrupts(void) {
  const struct KtExchange* events = kt_exchange;
  robot.in_interrupt = KT_IN_TX_SUCCESS;
  if (events->sent) kilo_message_tx_success();
  robot.in_interrupt = KT_IN_RX;
  arrivals.count = events->receptions;
  arrivals.drawn = arrivals.cycle = 0;
  for (uint32_t i = 0; i < events->receptions && !robot.reset && !robot.deaf; ++i) {
    const struct KtReception* reception = &events->reception[i];
    arrivals.index = i;
    __builtin_memcpy(&rx_msg, &reception->message, sizeof rx_msg);
    rx_dist.low_gain = reception->low_gain;
    rx_dist.high_gain = robot.trigger_lost ? robot.adc : reception->high_gain;
    robot.trigger_lost = 0;
    robot.heard = 1;
    if (!hears(rx_msg.type)) continue;
    if (events->wrong_crc && rx_msg.crc != message_crc(&rx_msg)) continue;
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

static uint64_t transmit(void) {
  if (robot.state != RUNNING) return 0;
  robot.in_interrupt = KT_IN_TX;
  const message_t* message = kilo_message_tx();
  robot.in_interrupt = 0;
  if (message == NULL) return 0;
  __builtin_memcpy(&kt_exchange->message, message, sizeof kt_exchange->message);
  return 1;
}

/* Defined when the program is linked. */
extern uint8_t kilotwin_variables[] __attribute__((visibility("hidden")));

__attribute__((visibility("default"), used)) const struct KtImage kilotwin_image = {
    KT_IMAGE_MAGIC,
    KT_IMAGE_VERSION,
    (uint64_t)&kt_exchange,
    (uint64_t)&robot,
    (uint64_t)&kilo_ticks,
    (uint64_t)&kilo_tx_period,
    (uint64_t)&boot,
    (uint64_t)&kt_enter,
    (uint64_t)&kt_call,
    (uint64_t)&kt_leave,
    (uint64_t)&interrupts,
    (uint64_t)&transmit,
    (uint64_t)&kt_surroundings,
    (uint64_t)kilotwin_variables,
};
