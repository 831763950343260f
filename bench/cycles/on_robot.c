/* For an ATmega328P in simavr: 1 to GPIOR0 before a call, 2 after it, 3 when a function is done with. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "functions.h"

int main(void) {
#define MEASURE(function)                     \
  for (uint8_t k = 0; k < REPETITIONS; k++) { \
    GPIOR0 = 1;                               \
    function();                               \
    GPIOR0 = 2;                               \
  }                                           \
  GPIOR0 = 3;
  ALL_FUNCTIONS
  cli();
  sleep_enable();
  sleep_cpu();
  for (;;) {}
}
