/* The cycle budget of the code that runs: image_abi.h. While a robot's code runs, the lowest 32 bits of xmm15 hold it; the others
 * are 0. In memory, each counter would wait for the one before it to pass through the store buffer. A general-purpose register would
 * be one less for the compiler, whose code the estimate of cycles depends on. */
#ifndef KILOTWIN_BUDGET_H
#define KILOTWIN_BUDGET_H

#include <stdint.h>

static inline int32_t cycles_left(void) {
  int32_t left;
  __asm__ volatile("movd %%xmm15, %0" : "=r"(left));
  return left;
}

static inline void set_cycles_left(int32_t left) { __asm__ volatile("movd %0, %%xmm15" : : "r"(left) : "memory"); }

/* Takes cycles that the robot needs and the counters do not see. */
static inline void charge(int32_t cycles) {
  typedef int32_t Lanes __attribute__((vector_size(16)));
  const Lanes taken = {cycles};
  __asm__ volatile("psubd %0, %%xmm15" : : "m"(taken) : "memory");
}

#endif
