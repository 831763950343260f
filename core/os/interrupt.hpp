/// SIGINT and SIGTERM as a flag for loops to poll.
#pragma once

namespace kilotwin {

/// After this call SIGINT and SIGTERM set the flag and do not end the process. A second SIGINT ends it.
void catch_interrupts();
/// The signal that arrived, or 0.
[[nodiscard]] int interrupted();

}  // namespace kilotwin
