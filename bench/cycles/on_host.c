/* The same as a robot's program: reads the budget that its own code counts down, and prints by the robot's log. */
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdio.h>

#include "functions.h"

static int32_t budget(void) {
  int32_t left;
  __asm__ volatile("movl %%gs:24, %0" : "=r"(left) : : "memory");
  return left;
}

static void setup(void) {
  delay(100); /* A new tick, so that no measurement meets its end. */
#define MEASURE(function)                                    \
  {                                                          \
    int32_t sum = 0;                                         \
    for (uint8_t k = 0; k < REPETITIONS; k++) {              \
      const int32_t before = budget();                       \
      function();                                            \
      sum += before - budget();                              \
    }                                                        \
    printf("cycles %s %ld\n", #function, sum / REPETITIONS); \
    delay(40);                                               \
  }
  ALL_FUNCTIONS
}

static void loop(void) {}

int main(void) {
  kilo_init();
  debug_init();
  kilo_start(setup, loop);
  return 0;
}
