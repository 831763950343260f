/// Resource limits of this process.
#pragma once

#include <cstdint>
#include <string>

namespace kilotwin {

/// Raises the soft limit of open files and sockets to `count`. Throws RunError if the hard limit is lower. `what` is the subject
/// of the error line, e.g. "a service".
void require_open_files(std::uint64_t count, const std::string& what);

}  // namespace kilotwin
