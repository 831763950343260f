/// Precedence of this process over others on a busy machine.
#pragma once

namespace kilotwin::os {

/// Asks the system for real-time scheduling (SCHED_RR, lowest priority) of this thread, and of those that it starts later.
/// False where the system does not allow it.
[[nodiscard]] bool take_precedence();

}  // namespace kilotwin::os
