/// RequestAllowance: how many requests a viewer may send. One that sends too many is disconnected, and costs nobody else.
#pragma once

#include <algorithm>
#include <chrono>

namespace kilotwin::http {

/// Most requests per second of one viewer. A page sends some 60, one for each picture.
inline constexpr double kMostRequestsPerSecond = 500;

/// A bucket that fills at kMostRequestsPerSecond and holds those of one second; each request takes one.
class RequestAllowance {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes a request at `now`; times ascend. False: there were too many.
  [[nodiscard]] bool take(Clock::time_point now) {
    left_ += kMostRequestsPerSecond * std::chrono::duration<double>(now - counted_).count();
    left_ = std::min(left_, kMostRequestsPerSecond) - 1;
    counted_ = now;
    return left_ >= 0;
  }

 private:
  double left_ = kMostRequestsPerSecond;
  Clock::time_point counted_ = Clock::now();
};

}  // namespace kilotwin::http
