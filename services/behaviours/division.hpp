/// Integer division by zero with the results of the robot's processor, which divides in software and has no trap.
#pragma once

#include <ucontext.h>

namespace kilotwin::behaviours {

/// Emulates the division instruction at which a thread has faulted, and steps past it. Returns false if the instruction is neither
/// a division by zero nor INT_MIN / -1. Results are those of avr-libgcc. For a division by zero the remainder is the dividend; the
/// unsigned quotient is all ones, the signed one is -1, or 1 if the dividend is negative. INT_MIN / -1 gives INT_MIN.
[[nodiscard]] bool divide_as_robot(gregset_t& registers);

}  // namespace kilotwin::behaviours
