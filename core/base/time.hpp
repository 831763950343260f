/// Simulated time: a number of ticks. It has no clock and no conversion from or to std::chrono, so it cannot be mixed with
/// wall time, for which services use std::chrono::steady_clock.
#pragma once

#include <compare>
#include <cstdint>

namespace kilotwin {

/// A point in simulated time, in ticks since the start of the experiment. Tick 0 is the initial state. Negative values
/// mark hello samples.
class Tick {
 public:
  constexpr Tick() = default;
  constexpr explicit Tick(std::int64_t count) : count_(count) {}
  [[nodiscard]] constexpr std::int64_t count() const { return count_; }
  constexpr auto operator<=>(const Tick&) const = default;
  constexpr Tick& operator++() {
    ++count_;
    return *this;
  }
  friend constexpr Tick operator+(Tick t, std::int64_t n) { return Tick{t.count_ + n}; }
  friend constexpr Tick operator-(Tick t, std::int64_t n) { return Tick{t.count_ - n}; }
  friend constexpr std::int64_t operator-(Tick a, Tick b) { return a.count_ - b.count_; }

 private:
  std::int64_t count_ = 0;
};

/// The robots' nominal clock, Hz (kilolib: F_CPU).
inline constexpr double kNominalClockHz = 8.0e6;

/// Duration of a tick, constant within a run: 2^18 cycles = 32.768 ms unless the experiment sets another value.
class TickLength {
 public:
  constexpr explicit TickLength(std::uint32_t cycles) : cycles_(cycles) {}
  [[nodiscard]] constexpr std::uint32_t cycles() const { return cycles_; }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(cycles_) / kNominalClockHz; }
  /// Simulated seconds from the start to `t`.
  [[nodiscard]] constexpr double seconds_at(Tick t) const { return static_cast<double>(t.count()) * seconds(); }
  /// The first tick at or after `seconds` (>= 0).
  [[nodiscard]] constexpr Tick at_or_after(double seconds) const {
    const double ticks = seconds / this->seconds();
    auto whole = static_cast<std::int64_t>(ticks);
    if (static_cast<double>(whole) < ticks) ++whole;
    return Tick{whole};
  }

 private:
  std::uint32_t cycles_;
};

}  // namespace kilotwin
