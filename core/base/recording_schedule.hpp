/// The instants at which something is recorded: multiples of an interval, each at the first tick at or after it.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace kilotwin {

/// The first tick at or after `seconds` (>= 0). A multiple of an interval that rounding raises by some nanoseconds above a
/// tick counts as that tick.
[[nodiscard]] inline Tick tick_at_or_after(TickLength length, double seconds) {
  constexpr double kSlack_ticks = 1e-6;
  const double ticks = seconds / length.seconds() - kSlack_ticks;
  if (ticks <= 0) return Tick{0};
  const auto whole = static_cast<std::int64_t>(ticks);
  return Tick{static_cast<double>(whole) < ticks ? whole + 1 : whole};
}

/// Ticks at which states are recorded: the first tick at or after 0, every_s, 2 every_s... The first and last states of a
/// run are recorded in addition.
class RecordingSchedule {
 public:
  RecordingSchedule(TickLength tick_length, double every_s) : tick_length_(tick_length), every_s_(every_s) {}
  [[nodiscard]] bool due(Tick tick) const { return at_or_after(tick) == tick; }
  /// The tick of instant `number` * every_s.
  [[nodiscard]] Tick tick(std::int64_t number) const {
    return tick_at_or_after(tick_length_, static_cast<double>(number) * every_s_);
  }
  /// The first instant whose tick is `from` (>= 0) or later.
  [[nodiscard]] std::int64_t number_from(Tick from) const {
    // The quotient is exact to +-1. If an interval is shorter than a tick, several instants have the same tick.
    auto number = static_cast<std::int64_t>(tick_length_.seconds_at(from) / every_s_);
    while (number > 0 && tick(number - 1) >= from) --number;
    while (tick(number) < from) ++number;
    return number;
  }
  /// The first scheduled tick at or after `from` (>= 0).
  [[nodiscard]] Tick at_or_after(Tick from) const { return tick(number_from(from)); }

 private:
  TickLength tick_length_;
  double every_s_;
};

}  // namespace kilotwin
