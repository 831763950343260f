/// Full duty of both motors in a tick, as frames say it: ActuationFrame::spin_up.
#pragma once

#include <cstdint>

namespace kilotwin {

/// One call of kilolib's spinup_motors(), 15 ms: 100. Other times at full duty in proportion, up to 254. Full duty for the whole
/// tick, but for moments: 255.
inline constexpr std::uint8_t kOneSpinUp = 100, kFullDuty = 255;
/// Cycles of a spin-up at 8 MHz. Source: kilolib.
inline constexpr std::int64_t kSpinUpCycles = 120'000;

/// ActuationFrame::spin_up after this many cycles at full duty, in a tick of `tick_cycles`.
[[nodiscard]] constexpr std::uint8_t spin_up_of(std::int64_t full_cycles, std::int64_t tick_cycles) {
  constexpr std::int64_t kUnit = kSpinUpCycles / kOneSpinUp;
  if (full_cycles > tick_cycles - kUnit) return kFullDuty;
  const std::int64_t units = (full_cycles + kUnit / 2) / kUnit;
  return static_cast<std::uint8_t>(units < kFullDuty ? units : kFullDuty - 1);
}

}  // namespace kilotwin
