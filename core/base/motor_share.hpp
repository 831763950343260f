/// Chooses the duties that a frame shows of a tick in which a program changed them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/base/motor_phases.h"

namespace kilotwin {

/// A frame has one pair of duties per tick. Over many ticks it shows each pair for as long as the program set it, to within a few
/// ticks. A mean of the duties would be wrong: the speed is not linear in the duty, and in the dead band it is 0.
struct MotorShare {
  static constexpr std::uint32_t kPairs = KILOTWIN_MOTOR_PAIRS;

  /// Of pairs that the program has set: the time for which it set them, less the time for which they were shown; cycles.
  std::int32_t credit[kPairs] = {};
  std::uint8_t left[kPairs] = {}, right[kPairs] = {};

  struct Pair {
    std::uint8_t left, right;
  };
  /// The pair to show for a tick: of those of the tick, the one with the largest credit. `phases`: the whole tick but its time at
  /// full duty, at least one pair.
  Pair choose(const KilotwinMotorPhases& phases) {
    bool is_present[kPairs] = {};
    std::int32_t total = 0;
    // A robot may have overwritten the phases.
    const std::uint32_t count = std::min(phases.count, KILOTWIN_MOTOR_PAIRS);
    for (std::uint32_t p = 0; p < count; ++p) {
      const auto cycles = static_cast<std::int32_t>(std::min(phases.cycles[p], kMostCycles));
      const std::uint32_t n = entry_of({phases.left[p], phases.right[p]}, is_present);
      is_present[n] = true;
      credit[n] += cycles;
      total += cycles;
    }
    std::uint32_t shown = kPairs;
    for (std::uint32_t n = 0; n < kPairs; ++n) {
      if (is_present[n] && (shown == kPairs || credit[n] > credit[shown])) shown = n;
    }
    credit[shown] -= total;
    return {left[shown], right[shown]};
  }

 private:
  static constexpr std::uint32_t kMostCycles = 1u << 24;

  /// A pair without an entry takes the place of the one with the least credit or debt that is not needed in this tick.
  std::uint32_t entry_of(Pair pair, const bool (&is_needed)[kPairs]) {
    std::uint32_t least = kPairs;
    for (std::uint32_t n = 0; n < kPairs; ++n) {
      if (left[n] == pair.left && right[n] == pair.right) return n;
      if (is_needed[n]) continue;
      if (least == kPairs || magnitude(credit[n]) < magnitude(credit[least])) least = n;
    }
    left[least] = pair.left;
    right[least] = pair.right;
    credit[least] = 0;
    return least;
  }
  static std::int32_t magnitude(std::int32_t v) { return v < 0 ? -v : v; }
};

static_assert(sizeof(MotorShare) == 24, "checkpoints hold it as it is");

}  // namespace kilotwin
