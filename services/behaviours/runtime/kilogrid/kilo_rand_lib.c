/* Random numbers of robots and of modules: a part of robot.c and of module.c. */
#include <kilo_rand_lib.h>
#include <kilolib.h>
#include <math.h>
#include <stdlib.h>

#define WEAK __attribute__((weak))

WEAK void g_ran_set_seed_uint32(uint32_t seed) {
  uint8_t i;
  for (i = 0; seed == 0 && i < 4; ++i) seed = seed << 8 | rand_hard();
  srandom(seed);
}

WEAK double g_ran_uniform() { return (double)random() / RANDOM_MAX; }
WEAK uint32_t g_ran_uniform_uint32() { return (uint32_t)(g_ran_uniform() * 4294967295.0); }

/* In (0, 1], for logarithms. */
static double above_zero(void) { return ((double)random() + 1) / ((double)RANDOM_MAX + 1); }

WEAK double g_ran_exponential(double rate) { return -log(above_zero()) / rate; }

/* Box and Muller's method gives two numbers at a time. */
WEAK double g_ran_gaussian(double mean, double sd) {
  static double second;
  static uint8_t has_second;
  double radius, angle;
  if (has_second) {
    has_second = 0;
    return mean + sd * second;
  }
  radius = sqrt(-2 * log(above_zero()));
  angle = 2 * M_PI * g_ran_uniform();
  second = radius * sin(angle);
  has_second = 1;
  return mean + sd * radius * cos(angle);
}
