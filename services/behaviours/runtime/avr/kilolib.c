/* kilolib for the robot's processor, an ATmega328P at 8 MHz, written from the robot's observed behaviour and timing. It has the
 * headers, the packet format, the pins and the EEPROM layout of the original library, so robots with either library can
 * communicate. */
#undef KILOTWIN_KILOGRID /* its message types are those of programs */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <kilolib.h>
#include <stdlib.h>
#include <util/crc16.h>
#include <util/delay.h>

#include "../core/base/message_crc.h"

uint8_t kilo_send(const uint8_t* packet); /* infrared.S; returns 0 if carrier sense noticed another packet */

/* Whether this is part of boot_loader.c, which takes the messages of all types itself. */
#ifdef KILO_BOOT_LOADER
#define IS_BOOT_LOADER 1
#else
#define IS_BOOT_LOADER 0
#endif

enum { SLEEPING, IDLE, BATTERY, SETUP, RUNNING, CHARGING, MOVING };
enum { STAND, TURN_LEFT, TURN_RIGHT, STRAIGHT };

/* EEPROM addresses. */
enum {
  EE_OSCCAL = 0x01,
  EE_TURN_LEFT = 0x05,
  EE_TURN_RIGHT = 0x09,
  EE_STRAIGHT_LEFT = 0x0c,
  EE_STRAIGHT_RIGHT = 0x14,
  EE_IR_LOW = 0x20,
  EE_IR_HIGH = 0x50,
  EE_TX_MASK = 0x90,
  EE_UID = 0xb0
};
#define IR_ENTRIES 14

/* Cycles of a bit and of half a bit, and the receiver's timeout of 11 bits. */
#define BIT 269
#define HALF_BIT 134
#define TIMEOUT 2959

enum { PACKET_OCTETS = 12 };

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
volatile uint16_t kilo_tx_period;
uint16_t kilo_uid;
uint8_t kilo_turn_left, kilo_turn_right, kilo_straight_left, kilo_straight_right;
uint16_t kilo_irhigh[IR_ENTRIES], kilo_irlow[IR_ENTRIES];
message_t rx_msg;
distance_measurement_t rx_dist;
volatile uint8_t rx_busy;
volatile uint8_t tx_mask;
uint16_t tx_clock, tx_increment;

static volatile uint8_t state;
static volatile uint8_t motion, motion_done;

/* The ADC. While no program takes a reading, edges of the comparator start conversions of the high-gain amplifier. */

static void listen_to(uint8_t channel) {
  ADMUX = _BV(REFS0) | channel;
  ADCSRA = _BV(ADEN) | _BV(ADATE) | _BV(ADPS1) | _BV(ADPS0);
}

/* Clocks of the ADC: 1 MHz, and the 62.5 kHz that the temperature sensor needs. */
enum { AT_1_MHZ = _BV(ADPS1) | _BV(ADPS0), AT_62_KHZ = _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0) };

static uint16_t conversion(void) {
  while (ADCSRA & _BV(ADSC)) {}
  return ADC;
}

static uint16_t converted(uint8_t multiplexer, uint8_t clock) {
  ADMUX = multiplexer;
  ADCSRA = _BV(ADEN) | _BV(ADSC) | clock;
  return conversion();
}

/* `listens`: edges of the comparator start conversions again afterwards. */
static int16_t reading(uint8_t multiplexer, uint8_t clock, uint8_t listens) {
  if (rx_busy) return -1;
  const uint8_t flags = SREG;
  cli();
  const int16_t value = (int16_t)converted(multiplexer, clock);
  if (listens) listen_to(0);
  SREG = flags;
  return value;
}

int16_t get_ambientlight(void) { return reading(_BV(REFS0) | 7, AT_1_MHZ, 1); }
int16_t get_temperature(void) { return reading(_BV(REFS1) | _BV(REFS0) | 8, AT_62_KHZ, 1); }

/* As on robots with the original library, the next message's high-gain strength is this voltage. */
int16_t get_voltage(void) { return reading(_BV(REFS0) | 6, AT_1_MHZ, 0); }

/* Each bit is the first of two readings' lowest bits that differ, which noise makes a fair coin. After 128 tries the bit is that
 * of the last reading. A message that arrives meanwhile may lose its strength, or be lost. */
uint8_t rand_hard(void) {
  uint8_t value = 0;
  for (uint8_t bit = 0; bit < 8; ++bit) {
    uint8_t first, second, tries = 0;
    do {
      const uint8_t flags = SREG;
      cli();
      first = (uint8_t)converted(_BV(REFS0) | 6, AT_1_MHZ) & 1;
      second = (uint8_t)converted(_BV(REFS0) | 6, AT_1_MHZ) & 1;
      listen_to(0);
      SREG = flags;
    } while (first == second && ++tries < 128);
    value |= (uint8_t)(first << bit);
  }
  return value;
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

/* Motors and light. */

void set_motors(uint8_t left, uint8_t right) {
  OCR2A = left;
  OCR2B = right;
}

static void motors_on(void) {
  DDRB |= _BV(3);
  DDRD |= _BV(3);
}

static void motors_off(void) {
  DDRB &= (uint8_t)~_BV(3);
  DDRD &= (uint8_t)~_BV(3);
}

void spinup_motors(void) {
  set_motors(255, 255);
  delay(15);
}

/* A colour is on while its pins are outputs at low level. Each colour has two pins with different resistors. */
void set_color(uint8_t color) {
  uint8_t c = DDRC & (uint8_t) ~(_BV(2) | _BV(3) | _BV(4) | _BV(5));
  uint8_t d = DDRD & (uint8_t) ~(_BV(4) | _BV(5));
  if (color & 1) d |= _BV(5);
  if (color & 2) d |= _BV(4);
  if (color & 4) c |= _BV(3);
  if (color & 8) c |= _BV(2);
  if (color & 16) c |= _BV(5);
  if (color & 32) c |= _BV(4);
  DDRC = c;
  DDRD = d;
}

void delay(uint16_t ms) {
  while (ms-- > 0) _delay_ms(1);
}

/* Messages. */

uint16_t message_crc(const message_t* message) { return kilotwin_message_crc((const uint8_t*)message); }

/* Distance beyond contact, mm, for a reading between entries i - 1 and i of a table; linear interpolation. */
static uint8_t beyond_contact(const uint16_t* table, uint8_t i, int16_t value) {
  const int16_t step = (int16_t)(table[i] - table[i - 1]);
  return step == 0 ? 5 * i : (uint8_t)((int32_t)(value - (int16_t)table[i] + step * i) * 10 / (2 * step));
}

/* Index of the first entry below the reading, or `none`. */
static int8_t first_below(const uint16_t* table, int16_t value, int8_t none) {
  for (int8_t i = 0; i < IR_ENTRIES; ++i) {
    if (value > (int16_t)table[i]) return i;
  }
  return none;
}

uint8_t estimate_distance(const distance_measurement_t* distance) {
  enum { CONTACT = 33, BOTH_FROM = 700, LOW_ONLY_FROM = 900, TOO_FAR = 90 };
  const int16_t high = distance->high_gain, low = distance->low_gain;
  uint8_t by_high = 0, by_low = 0;
  if (high < LOW_ONLY_FROM) {
    const int8_t i = first_below(kilo_irhigh, high, IR_ENTRIES - 1);
    if (i != 0) by_high = beyond_contact(kilo_irhigh, (uint8_t)i, high);
  }
  if (high > BOTH_FROM) {
    const int8_t i = first_below(kilo_irlow, low, -1);
    if (i != 0) by_low = i < 0 ? TOO_FAR : beyond_contact(kilo_irlow, (uint8_t)i, low);
  }
  if (high <= BOTH_FROM) return CONTACT + by_high;
  if (high >= LOW_ONLY_FROM) return CONTACT + by_low;
  return (uint8_t)(CONTACT + (by_high * (int32_t)(LOW_ONLY_FROM - high) + by_low * (int32_t)(high - BOTH_FROM)) /
                                 (LOW_ONLY_FROM - BOTH_FROM));
}

/* Messages of the overhead controller. */

/* Restarts the program at its first instruction, with interrupts disabled. */
static void restart(void) {
  cli();
  __asm__ volatile("clr r1\n\tjmp 0");
}

/* Jumps to the boot loader, if its section is programmed. */
static void boot(void) {
  cli();
  TIMSK0 = 0;
  if (pgm_read_word(0x7000) != 0xffff) __asm__ volatile("jmp 0x7000");
  restart();
}

static void start_motion(uint8_t next, uint8_t changed) {
  if (motion == next && !changed) return;
  motion_done = STAND;
  motion = next;
}

static void store_calibration(void) {
  eeprom_update_byte((uint8_t*)EE_UID, (uint8_t)kilo_uid);
  eeprom_update_byte((uint8_t*)EE_UID + 1, (uint8_t)(kilo_uid >> 8));
  eeprom_update_byte((uint8_t*)EE_TURN_LEFT, kilo_turn_left);
  eeprom_update_byte((uint8_t*)EE_TURN_RIGHT, kilo_turn_right);
  eeprom_update_byte((uint8_t*)EE_STRAIGHT_LEFT, kilo_straight_left);
  eeprom_update_byte((uint8_t*)EE_STRAIGHT_RIGHT, kilo_straight_right);
}

static void calibrate(const calibmsg_t* wish) {
  switch (wish->mode) {
    case CALIB_SAVE:
      if (state == MOVING) {
        store_calibration();
        motors_off();
        state = IDLE;
      }
      return;
    case CALIB_UID:
      kilo_uid = wish->uid;
      motion = STAND;
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
  if (state == MOVING) return;
  motors_on();
  state = MOVING;
}

static void obey(void) {
  if (rx_msg.type != READUID && rx_msg.type != RUN && rx_msg.type != CALIB) motors_off();
  switch (rx_msg.type) {
    case BOOT: boot(); break;
    case RESET: restart(); break;
    case SLEEP: state = SLEEPING; break;
    case WAKEUP: state = IDLE; break;
    case CHARGE: state = CHARGING; break;
    case VOLTAGE: state = BATTERY; break;
    case RUN:
      if (state != SETUP && state != RUNNING) {
        motors_on();
        state = SETUP;
      }
      break;
    case CALIB: calibrate((const calibmsg_t*)rx_msg.data); break;
    case READUID:
      if (state != MOVING) {
        motors_on();
        set_color(0);
        motion = motion_done = STAND;
        state = MOVING;
      }
      motion = rx_msg.data[0] < 16 && (kilo_uid >> rx_msg.data[0] & 1) ? TURN_LEFT : STAND;
      break;
    default: break;
  }
}

/* The receiver. The start bit's pulse starts timer 1. The timer's value at a later pulse gives the number of the bit that is 1. */

static uint8_t in_octet;    /* 1: the octet's start bit has arrived */
static uint8_t octet_count; /* complete octets, the leading one included */
static uint8_t octet;
static uint16_t crc; /* of the octets so far: messages may follow each other with 600 cycles in between */

static void stop_receiving(void) {
  TCCR1B = 0;
  in_octet = octet_count = 0;
  rx_busy = 0;
  listen_to(0);
}

ISR(TIMER1_COMPA_vect) { stop_receiving(); }

static void take_octet(void) {
  in_octet = 0;
  if (octet_count == 0) {
    if (octet != 0) {
      stop_receiving(); /* a collision: the leading octet of a packet is 0 */
      return;
    }
    rx_dist.low_gain = (int16_t)conversion();
    listen_to(0);
    crc = 0xffff;
  } else {
    ((uint8_t*)&rx_msg)[octet_count - 1] = octet;
    if (octet_count <= PACKET_OCTETS - sizeof rx_msg.crc) crc = _crc_ccitt_update(crc, octet);
  }
  if (++octet_count <= PACKET_OCTETS) return;
  stop_receiving();
  if (rx_msg.crc != crc) return;
  if (IS_BOOT_LOADER || rx_msg.type < BOOT)
    kilo_message_rx(&rx_msg, &rx_dist);
  else
    obey();
}

ISR(ANALOG_COMP_vect) {
  const uint16_t time = TCNT1;
  rx_busy = 1;
  if (!in_octet) {
    TCNT1 = 0;
    TCCR1B = _BV(CS10);
    in_octet = 1;
    octet = 0;
    if (octet_count == 0) {
      rx_dist.high_gain = (int16_t)conversion();
      listen_to(1);
    }
    return;
  }
  if (time <= HALF_BIT || time >= HALF_BIT + 9 * BIT) {
    stop_receiving();
    return;
  }
  const uint8_t bit = (uint8_t)((uint32_t)(time - HALF_BIT) * (65536 / BIT + 1) >> 16);
  if (bit < 8)
    octet |= (uint8_t)(1 << bit);
  else
    take_octet();
}

/* The clock ticks every 256 counts of 1024 cycles. After a failed attempt to send, one tick has a random length. */

ISR(TIMER0_COMPA_vect) {
  ++kilo_ticks;
  tx_clock += tx_increment;
  tx_increment = 255;
  OCR0A = 255;
  if (rx_busy || tx_clock <= kilo_tx_period || state != RUNNING) return;
  const message_t* message = kilo_message_tx();
  if (message == NULL) return;
  if (kilo_send((const uint8_t*)message)) {
    tx_clock = 0;
    kilo_message_tx_success();
  } else {
    tx_increment = rand() & 0xff;
    OCR0A = (uint8_t)tx_increment;
  }
}

/* The state machine. */

static uint16_t table_entry(uint16_t address) {
  return (uint16_t)(eeprom_read_byte((const uint8_t*)address) << 8) |
         eeprom_read_byte((const uint8_t*)(address + 1));
}

void kilo_init(void) {
  cli();
  PORTB = PORTC = PORTD = 0;
  DDRB = DDRC = DDRD = 0;
  DDRD |= _BV(2);
  PORTD |= _BV(2); /* power for the sensors */

  const uint8_t oscillator = eeprom_read_byte((const uint8_t*)EE_OSCCAL);
  if (oscillator != 0xff) OSCCAL = oscillator;
  kilo_turn_left = eeprom_read_byte((const uint8_t*)EE_TURN_LEFT);
  kilo_turn_right = eeprom_read_byte((const uint8_t*)EE_TURN_RIGHT);
  kilo_straight_left = eeprom_read_byte((const uint8_t*)EE_STRAIGHT_LEFT);
  kilo_straight_right = eeprom_read_byte((const uint8_t*)EE_STRAIGHT_RIGHT);
  kilo_uid =
      (uint16_t)(eeprom_read_byte((const uint8_t*)EE_UID) | eeprom_read_byte((const uint8_t*)EE_UID + 1) << 8);
  for (uint8_t i = 0; i < IR_ENTRIES; ++i) {
    kilo_irlow[i] = table_entry(EE_IR_LOW + 2u * i);
    kilo_irhigh[i] = table_entry(EE_IR_HIGH + 2u * i);
  }
  tx_mask = eeprom_read_byte((const uint8_t*)EE_TX_MASK);
  if (tx_mask == 0 || (tx_mask & 0x38) != 0) tx_mask = _BV(0);
  DDRB |= tx_mask;

  kilo_ticks = 0;
  kilo_tx_period = 3906;
  tx_clock = 0;
  tx_increment = 255;
  state = IDLE;
  motion = motion_done = STAND;

  TCCR0A = 0;
  TCCR0B = _BV(CS02) | _BV(CS00);
  TCNT0 = 0;
  OCR0A = 255;
  TIMSK0 = _BV(OCIE0A);
  TCCR1A = TCCR1B = 0;
  OCR1A = TIMEOUT;
  TIMSK1 = _BV(OCIE1A);
  TCCR2A = _BV(COM2A1) | _BV(COM2B1) | _BV(WGM20);
  TCCR2B = _BV(CS21);
  set_motors(0, 0);

  DIDR1 = _BV(AIN1D) | _BV(AIN0D);
  ADCSRB = _BV(ADTS0);
  stop_receiving();
  ACSR = _BV(ACI);
  ACSR = _BV(ACIE) | _BV(ACIS1) | _BV(ACIS0);
  sei();
}

static void follow_calibration(void) {
  const uint8_t next = motion;
  if (next == motion_done) return;
  motion_done = next;
  const uint8_t left = next == TURN_LEFT || next == STRAIGHT, right = next == TURN_RIGHT || next == STRAIGHT;
  if (left || right) {
    set_motors(left ? 255 : 0, right ? 255 : 0);
    delay(15);
  }
  switch (next) {
    case TURN_LEFT: set_motors(kilo_turn_left, 0); break;
    case TURN_RIGHT: set_motors(0, kilo_turn_right); break;
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    default: set_motors(0, 0);
  }
}

EMPTY_INTERRUPT(WDT_vect)

/* Sleeps for 8 s with all clocks off, then listens for 10 ms. */
static void sleep_and_listen(void) {
  set_color(0);
  cli();
  PORTD &= (uint8_t)~_BV(2);
  ACSR |= _BV(ACD);
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDIE) | _BV(WDP3) | _BV(WDP0);
  set_sleep_mode(SLEEP_MODE_PWR_DOWN);
  sleep_enable();
  sei();
  sleep_cpu();
  sleep_disable();
  wdt_disable();
  PORTD |= _BV(2);
  ACSR = _BV(ACI);
  ACSR = _BV(ACIE) | _BV(ACIS1) | _BV(ACIS0);
  set_color(RGB(3, 3, 3));
  delay(10);
  set_color(0);
  if (!rx_busy) return;
  set_color(RGB(3, 0, 0));
  delay(100);
  set_color(0);
}

static void show_battery(void) {
  const int16_t voltage = get_voltage();
  if (voltage < 0) return;
  if (voltage > 682)
    set_color(RGB(0, 3, 0));
  else if (voltage > 648)
    set_color(RGB(0, 0, 3));
  else if (voltage > 614)
    set_color(RGB(3, 3, 0));
  else
    set_color(RGB(3, 0, 0));
}

/* Blinks once. A message that changes the state ends the wait. */
static void blink(uint8_t color, uint8_t on_ms, uint8_t off_ms) {
  const uint8_t before = state;
  set_color(color);
  delay(on_ms);
  set_color(0);
  for (uint8_t i = 0; i < off_ms && state == before; ++i) delay(1);
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
  uint8_t has_setup = 0;
  for (;;) {
    switch (state) {
      case SLEEPING: sleep_and_listen(); break;
      case BATTERY: show_battery(); break;
      case CHARGING:
        if ((PIND & _BV(0)) == 0)
          blink(RGB(1, 0, 0), 50, 250);
        else
          set_color(0);
        break;
      case SETUP:
        set_color(0);
        if (!has_setup) {
          has_setup = 1;
          setup();
        }
        cli(); /* a message may change the state at any time until here */
        if (state == SETUP) state = RUNNING;
        sei();
        break;
      case RUNNING: loop(); break;
      case MOVING: follow_calibration(); break;
      default: blink(RGB(0, 1, 0), 1, 200);
    }
  }
}
