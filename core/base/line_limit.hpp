/// Keeps lines that outsiders can provoke from flooding a log: one per interval passes, the others are counted.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace kilotwin {

class LineLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LineLimit(Clock::duration interval) : interval_(interval) {}

  /// How many lines were withheld since the last one that passed; nothing where this one is withheld.
  [[nodiscard]] std::optional<std::uint64_t> pass(Clock::time_point now) {
    if (passed_ && now - *passed_ < interval_) {
      ++withheld_;
      return std::nullopt;
    }
    passed_ = now;
    const std::uint64_t withheld = withheld_;
    withheld_ = 0;
    return withheld;
  }

 private:
  const Clock::duration interval_;
  std::optional<Clock::time_point> passed_;
  std::uint64_t withheld_ = 0;
};

}  // namespace kilotwin
