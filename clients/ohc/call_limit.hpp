/// A limit for system calls that have none of their own, such as tcdrain().
#pragma once

#include <chrono>
#include <ctime>
#include <optional>

namespace kilotwin::ohc {

/// While it exists, blocking calls of this thread end with EINTR once the limit has passed, and each further one soon after it
/// began. Other threads are not touched.
class CallLimit {
 public:
  /// Where the system has no timer left, there is no limit. The first time, a line on standard error says so.
  explicit CallLimit(std::chrono::milliseconds limit);
  ~CallLimit();
  CallLimit(const CallLimit&) = delete;
  CallLimit& operator=(const CallLimit&) = delete;

 private:
  std::optional<timer_t> timer_;
};

}  // namespace kilotwin::ohc
