/// The machine's two clocks, in nanoseconds.
#pragma once

#include <chrono>
#include <cstdint>

namespace kilotwin {

namespace detail {
template <typename Clock> std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}
}  // namespace detail

/// Time since 1970-01-01 UTC, without leap seconds. It jumps where somebody sets the clock.
[[nodiscard]] inline std::int64_t utc_ns() { return detail::now_ns<std::chrono::system_clock>(); }

/// Time since an arbitrary moment. It never jumps.
[[nodiscard]] inline std::int64_t steady_ns() { return detail::now_ns<std::chrono::steady_clock>(); }

}  // namespace kilotwin
