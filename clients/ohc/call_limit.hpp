/// A limit for system calls that have none of their own, such as tcdrain().
#pragma once

#include <chrono>
#include <ctime>

namespace kilotwin::ohc {

/// While it exists, blocking calls of this thread end with EINTR once the limit has passed, and each further one soon after it
/// began. Other threads are not touched.
class CallLimit {
 public:
  /// Throws RunError where the system has no timer left.
  explicit CallLimit(std::chrono::milliseconds limit);
  ~CallLimit();
  CallLimit(const CallLimit&) = delete;
  CallLimit& operator=(const CallLimit&) = delete;

 private:
  timer_t timer_{};
};

}  // namespace kilotwin::ohc
