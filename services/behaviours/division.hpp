/// Division by zero as the robot's processor does it, which has no instruction for division and no trap.
#pragma once

#include <ucontext.h>

namespace kilotwin::behaviours {

/// If the instruction at which a thread has stopped is an integer division by zero, or the most negative number divided by
/// -1: gives it the result of avr-libgcc, steps past it, and returns true. By zero, the remainder is the dividend and the
/// quotient all ones without sign, -1 or, of a negative dividend, 1 with sign; otherwise the quotient is the dividend.
[[nodiscard]] bool divide_as_robot(gregset_t& registers);

}  // namespace kilotwin::behaviours
