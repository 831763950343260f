/* The cycle budget of the code that runs: image_abi.h. */
#ifndef KILOTWIN_BUDGET_H
#define KILOTWIN_BUDGET_H

#include <stdint.h>

#include "image_abi.h"

static inline int32_t cycles_left(void) {
  int32_t left;
  __asm__ volatile("movl %%gs:%c1, %0" : "=r"(left) : "i"(KT_THREAD_BUDGET));
  return left;
}

static inline void set_cycles_left(int32_t left) {
  __asm__ volatile("movl %0, %%gs:%c1" : : "r"(left), "i"(KT_THREAD_BUDGET) : "memory");
}

/* Takes cycles that the robot needs and the counters do not see. */
static inline void charge(int32_t cycles) { set_cycles_left(cycles_left() - cycles); }

#endif
