/// A local run happens in a process of its own, the worker: a robot's program that ends its process by a defect does not end
/// the process that starts the run again from its last checkpoint.
#pragma once

#include <optional>

#include "core/os/process.hpp"

namespace kilotwin::cli {

/// Starts the worker by fork(). In the worker it returns nothing: the worker does the run and ends as this process would have.
/// In the calling process it returns how the worker has ended, once it has. SIGINT and SIGTERM end the worker in
/// order; the worker does not outlive its parent. Only where no other thread runs. Throws RunError if fork() fails.
[[nodiscard]] std::optional<os::ProcessEnd> end_of_worker();

}  // namespace kilotwin::cli
