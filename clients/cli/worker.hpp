/// A local run happens in a process of its own, a worker, so that a robot's program that brings it down does not take along
/// the process that sees to what comes next.
#pragma once

#include <optional>

namespace kilotwin::cli {

/// Forks. In the worker, which is to run and then end as this process would have: nothing. In the process that called, when
/// the worker has ended: its status, as of waitpid(). SIGINT and SIGTERM end the worker in order, and the worker does not
/// outlive its parent. Only where no other thread runs. Throws RunError where there is no room for a process.
[[nodiscard]] std::optional<int> status_of_worker();

}  // namespace kilotwin::cli
