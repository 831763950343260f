/* The duties that a program set within one tick, and for how long each pair held. Full duty of both motors is counted elsewhere:
 * spin_up.hpp. In C and C++: for robots' programs, hosts and firmware robots. */
#ifndef KILOTWIN_CORE_BASE_MOTOR_PHASES_H
#define KILOTWIN_CORE_BASE_MOTOR_PHASES_H

#include <stdint.h>

/* Of more pairs in one tick, each further one takes the place and the time of the shortest. */
#define KILOTWIN_MOTOR_PAIRS 4u

struct KilotwinMotorPhases {
  uint32_t count; /* 0: the duties have not changed in this tick */
  uint32_t from;  /* cycle of the tick since which the present duties hold */
  uint32_t cycles[KILOTWIN_MOTOR_PAIRS];
  uint8_t left[KILOTWIN_MOTOR_PAIRS];
  uint8_t right[KILOTWIN_MOTOR_PAIRS];
};

static inline void kilotwin_add_motors(struct KilotwinMotorPhases* phases, uint8_t left, uint8_t right,
                                       uint32_t cycles) {
  uint32_t n = 0, shortest = 0;
  if (left == 255 && right == 255) return;
  for (; n < phases->count && (phases->left[n] != left || phases->right[n] != right); ++n) {
    if (phases->cycles[n] < phases->cycles[shortest]) shortest = n;
  }
  if (n == KILOTWIN_MOTOR_PAIRS) {
    n = shortest;
  } else if (n == phases->count) {
    phases->count = n + 1;
    phases->cycles[n] = 0;
  }
  phases->left[n] = left;
  phases->right[n] = right;
  phases->cycles[n] += cycles;
}

#endif
