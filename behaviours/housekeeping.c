/* The robots' side of the base station's house-keeping: identification, assignment of numbers, calibration of the motors. The
 * station's side: services/ark/plugins/identify.cpp, assign_ids.cpp, calibrate.cpp. Broadcasts carry their type and up to 9
 * octets; messages to single robots are those of ark_hub.c.
 * Broadcast 120 asks for a number: its robot shows blue, all others red; 0xFFFF ends it.
 * Broadcasts 10, 1, 3, 4, 5, 2 assign numbers; 110 and 111 store the duties of turns and of straight motion. */
#include <avr/eeprom.h>
#include <kilolib.h>

enum {
  DRAW = 1,
  SET = 2,
  RETRY = 3,
  DIGIT = 4,
  CONFIRM = 5,
  METHOD = 10,
  STORE_TURN = 110,
  STORE_STRAIGHT = 111,
  IDENTIFY = 120
};
enum { LEFT = 1, RIGHT = 2, STOP = 3, STRAIGHT_L = 4, STRAIGHT_R = 5 };

#define BINARY_DIGITS 11
#define TERNARY_NUMBERS 6561 /* 3^8 */
#define NOBODY 0xffff
/* Where kilolib has them in the EEPROM. */
#define EEPROM_UID ((uint16_t*)0xb0)
#define EEPROM_TURN_LEFT ((uint8_t*)0x05)
#define EEPROM_TURN_RIGHT ((uint8_t*)0x09)
#define EEPROM_STRAIGHT_LEFT ((uint8_t*)0x0c)
#define EEPROM_STRAIGHT_RIGHT ((uint8_t*)0x14)

static uint8_t base = 2, has_drawn, is_numbered;
static uint16_t temporary;
static uint8_t colour;
/* What loop() writes: writing takes longer than a message may. */
static volatile uint8_t store_uid, store_turn, store_straight;

static uint16_t number_at(const uint8_t* octets) { return (uint16_t)octets[0] << 8 | octets[1]; }

static void draw(void) {
  const uint16_t bits = (uint16_t)rand_hard() << 8 | rand_hard();
  temporary = base == 2 ? bits & ((1u << BINARY_DIGITS) - 1) : bits % TERNARY_NUMBERS;
  has_drawn = 1;
}

static void show_digit(uint8_t index) {
  static const uint8_t colours[3] = {RGB(3, 0, 0), RGB(0, 0, 3), RGB(0, 3, 0)};
  uint16_t rest = temporary;
  while (index-- > 0) rest /= base;
  colour = is_numbered ? RGB(0, 0, 0) : colours[rest % base];
}

static void broadcast(uint8_t type, const uint8_t* data) {
  switch (type) {
    case METHOD:
      base = data[0] == 0 ? 2 : 3;
      has_drawn = is_numbered = 0;
      colour = RGB(0, 0, 0);
      break;
    case DRAW:
    case RETRY:
      /* Copies of one broadcast follow each other; the digits that are shown next end the draw. */
      if (!is_numbered && !has_drawn) draw();
      break;
    case DIGIT:
      has_drawn = 0;
      show_digit(data[0]);
      break;
    case CONFIRM:
      colour = is_numbered ? RGB(0, 0, 0) : number_at(data) == temporary ? RGB(0, 0, 3) : RGB(3, 0, 0);
      break;
    case SET:
      if (is_numbered || number_at(data) != temporary) break;
      kilo_uid = number_at(data + 2);
      is_numbered = 1;
      store_uid = 1;
      colour = RGB(0, 0, 0);
      break;
    case IDENTIFY:
      colour = number_at(data) == NOBODY ? RGB(0, 0, 0) : number_at(data) == kilo_uid ? RGB(0, 0, 3) : RGB(3, 0, 0);
      break;
    case STORE_TURN: store_turn = 1; break;
    case STORE_STRAIGHT: store_straight = 1; break;
    default: break;
  }
}

static void obey(uint8_t type, uint8_t duty) {
  switch (type) {
    case LEFT:
      kilo_turn_left = duty;
      spinup_motors();
      set_motors(duty, 0);
      break;
    case RIGHT:
      kilo_turn_right = duty;
      spinup_motors();
      set_motors(0, duty);
      break;
    case STOP: set_motors(0, 0); break;
    case STRAIGHT_L: kilo_straight_left = duty; break;
    case STRAIGHT_R:
      kilo_straight_right = duty;
      spinup_motors();
      set_motors(kilo_straight_left, kilo_straight_right);
      break;
    default: break;
  }
}

static uint8_t last_type, last_duty;

static void receive(message_t* message, distance_measurement_t* strength) {
  uint8_t slot;
  (void)strength;
  if (message->type != 0) {
    broadcast(message->type, message->data);
    return;
  }
  for (slot = 0; slot < 3; ++slot) {
    const uint8_t* octets = message->data + 3 * slot;
    const uint16_t id = (uint16_t)octets[0] << 2 | octets[1] >> 6;
    const uint8_t type = octets[1] >> 2 & 15;
    if (id != kilo_uid) continue;
    /* The station repeats a message; motors are spun up once. */
    if (type == last_type && octets[2] == last_duty) continue;
    last_type = type;
    last_duty = octets[2];
    obey(type, octets[2]);
  }
}

static void setup(void) {}

static void loop(void) {
  set_color(colour);
  if (store_uid) {
    store_uid = 0;
    eeprom_write_word(EEPROM_UID, kilo_uid);
  }
  if (store_turn) {
    store_turn = 0;
    eeprom_write_byte(EEPROM_TURN_LEFT, kilo_turn_left);
    eeprom_write_byte(EEPROM_TURN_RIGHT, kilo_turn_right);
  }
  if (store_straight) {
    store_straight = 0;
    eeprom_write_byte(EEPROM_STRAIGHT_LEFT, kilo_straight_left);
    eeprom_write_byte(EEPROM_STRAIGHT_RIGHT, kilo_straight_right);
  }
}

int main(void) {
  kilo_init();
  kilo_message_rx = receive;
  kilo_start(setup, loop);
  return 0;
}
