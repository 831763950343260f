/* The cycle budget of the code that runs: image_abi.h. While a robot's code runs, the lowest 32 bits of xmm15 hold it. Bits 32 to 63
 * are 1 only if no memory was written since watch_writes(): each piece of code that may write counts them down, and a switch to the
 * host clears them. The others are 0. In memory, each counter would wait
 * for the one before it to pass through the store buffer. A general-purpose register would be one less for the compiler, whose
 * code the estimate of cycles depends on. */
#ifndef KILOTWIN_BUDGET_H
#define KILOTWIN_BUDGET_H

#include <stdint.h>

static inline int32_t cycles_left(void) {
  int32_t left;
  __asm__ volatile("movd %%xmm15, %0" : "=r"(left));
  return left;
}

static inline void set_cycles_left(int32_t left) { __asm__ volatile("movd %0, %%xmm15" : : "r"(left) : "memory"); }

/* From a call of watch_writes() on, has_written() is 1 if memory may have been written, or if the host has run meanwhile. Stack frames
 * of functions that have returned do not count. */
static inline void watch_writes(void) { __asm__ volatile("pinsrd $1, %0, %%xmm15" : : "r"(1) : "memory"); }
static inline uint8_t has_written(void) {
  int32_t count;
  __asm__ volatile("pextrd $1, %%xmm15, %0" : "=r"(count) : : "memory");
  return count != 1;
}

/* Takes cycles, a constant, that the robot needs and the counters do not see. */
typedef int32_t KtLanes __attribute__((vector_size(16)));
#define charge(cycles)                                                 \
  do {                                                                 \
    static const KtLanes charged = {(cycles)};                         \
    __asm__ volatile("psubd %0, %%xmm15" : : "m"(charged) : "memory"); \
  } while (0)

#endif
