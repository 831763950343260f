#include "core/os/precedence.hpp"

#include <sched.h>

namespace kilotwin::os {

bool take_precedence() {
  sched_param lowest{};
  lowest.sched_priority = sched_get_priority_min(SCHED_RR);
  return sched_setscheduler(0, SCHED_RR, &lowest) == 0;
}

}  // namespace kilotwin::os
