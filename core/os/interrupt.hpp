/// SIGINT and SIGTERM as a flag that loops look at.
#pragma once

namespace kilotwin {

/// From now on SIGINT and SIGTERM set the flag instead of ending the process; a second SIGINT ends it.
void catch_interrupts();
/// The signal that arrived, or 0.
[[nodiscard]] int interrupted();

}  // namespace kilotwin
