/* Small functions such as robots' programs have; each reads what no compiler knows and writes what none may leave out. */
#include <stdint.h>

static volatile uint8_t in8 = 37;
static volatile uint16_t in16 = 1234;
static volatile uint32_t in32 = 123456;
static volatile int16_t out;
uint8_t table[16], octets[12];
uint16_t distances[12] = {35, 48, 61, 33, 90, 72, 55, 41, 67, 80, 38, 52};
struct {
  uint8_t id, distance;
  uint32_t seen;
} neighbours[10];

#define FUNCTION(name) static __attribute__((noinline)) void name(void)

FUNCTION(state_machine) {
  static uint8_t state;
  static uint32_t last;
  const uint32_t now = in32;
  if (now > last + 32) {
    last = now;
    state++;
  }
  switch (state & 3) {
    case 0: out = 1; break;
    case 1: out = 2; break;
    case 2: out = in8 > 128 ? 3 : 4; break;
    default: out = 5;
  }
}

FUNCTION(sum_of_octets) {
  uint16_t sum = 0;
  for (uint8_t i = 0; i < 16; i++) sum += table[i];
  out = sum;
}

FUNCTION(neighbour_table) {
  const uint8_t id = in8;
  uint8_t i;
  for (i = 0; i < 10; i++)
    if (neighbours[i].id == id) break;
  if (i == 10) {
    uint8_t oldest = 0;
    for (i = 1; i < 10; i++)
      if (neighbours[i].seen < neighbours[oldest].seen) oldest = i;
    i = oldest;
    neighbours[i].id = id;
  }
  neighbours[i].seen = in32;
  neighbours[i].distance = in8 / 2;
  out = i;
}

FUNCTION(checksum) {
  uint16_t crc = 0xffff;
  for (uint8_t k = 0; k < 10; k++) {
    uint8_t x = octets[k] ^ (uint8_t)crc;
    x ^= (uint8_t)(x << 4);
    crc = (((uint16_t)x << 8) | (crc >> 8)) ^ (uint8_t)(x >> 4) ^ ((uint16_t)x << 3);
  }
  out = crc;
}

FUNCTION(mean_of_floats) {
  float sum = 0;
  for (uint8_t i = 0; i < 12; i++) sum += (float)distances[i] * 0.5f;
  out = (int16_t)(sum / 12.0f);
}

FUNCTION(division) { out = in16 / (in8 + 1) + in16 % 7; }

FUNCTION(products_of_32_bits) {
  uint32_t x = in32;
  for (uint8_t i = 0; i < 8; i++) x = x * 1103515245u + 12345u;
  out = x >> 16;
}

static __attribute__((noinline)) uint8_t soft_random(void) {
  static uint8_t accumulator, seed = 0xaa;
  uint8_t s = seed;
  s ^= s << 3;
  s ^= s >> 5;
  s ^= accumulator++ >> 2;
  return seed = s;
}

FUNCTION(random_walk) {
  const uint8_t r = soft_random();
  if (r < 100)
    out = 1;
  else if (r < 170)
    out = 2;
  else
    out = 3;
  if (out == in8) out = soft_random() % 3;
}

FUNCTION(bubble_sort) {
  for (uint8_t i = 0; i < 12; i++) distances[i] = (i * 37 + in8) & 127;
  for (uint8_t i = 0; i < 11; i++)
    for (uint8_t j = 0; j < 11 - i; j++)
      if (distances[j] > distances[j + 1]) {
        const uint16_t t = distances[j];
        distances[j] = distances[j + 1];
        distances[j + 1] = t;
      }
}

static __attribute__((noinline)) int16_t fibonacci(int16_t n) {
  return n < 2 ? n : fibonacci(n - 1) + fibonacci(n - 2);
}
FUNCTION(recursion) { out = fibonacci(10); }

FUNCTION(waiting_loop) {
  for (volatile uint16_t i = 0; i < 200; i++) {}
}

FUNCTION(packing) {
  octets[0] = in16 & 0xff;
  octets[1] = in16 >> 8;
  octets[2] = in8;
  octets[3] = (uint8_t)out;
  octets[9] = 0;
  for (uint8_t i = 4; i < 9; i++) octets[i] = table[i];
}

#define ALL_FUNCTIONS          \
  MEASURE(state_machine)       \
  MEASURE(sum_of_octets)       \
  MEASURE(neighbour_table)     \
  MEASURE(checksum)            \
  MEASURE(mean_of_floats)      \
  MEASURE(division)            \
  MEASURE(products_of_32_bits) \
  MEASURE(random_walk) MEASURE(bubble_sort) MEASURE(recursion) MEASURE(waiting_loop) MEASURE(packing)
enum { REPETITIONS = 4 };
