/// The hypotheses that the monitor tests: effects on a single robot, and effects on all robots together.
#pragma once

#include <span>

#include "clients/monitor/evidence.hpp"
#include "clients/monitor/signatures.hpp"

namespace kilotwin::monitor {

/// Hypotheses of one group share one estimate of dispersion (dispersion.hpp).
enum class Group : std::uint8_t { kGain, kBias, kHeading, kDrift, kShift, kCount };

struct Hypothesis {
  Suspect suspect;
  Group group;
  SizePrior prior;
};

/// The grid of onset times (signatures.hpp) on which hypotheses of this group are tested.
[[nodiscard]] constexpr Family family_of(Group group) {
  return group == Group::kHeading || group == Group::kShift ? Family::kAbsorbed : Family::kLasting;
}

/// Effects on a single robot: wheel gains and biases, heading, drift.
[[nodiscard]] std::span<const Hypothesis> robot_hypotheses();
/// Effects on all robots together.
[[nodiscard]] const Hypothesis& gain_of_all();
[[nodiscard]] const Hypothesis& drift_of_all();
[[nodiscard]] const Hypothesis& calibration_shift();
[[nodiscard]] const Hypothesis& patch();

/// The sufficient statistics of a robot's hypothesis, for an onset at `slot`.
[[nodiscard]] Sums sums_of(Suspect suspect, const Signatures& signatures, std::size_t slot, double wheel_base_mm);
/// The same for a calibration shift, whose `dimensions` columns begin at `first`.
[[nodiscard]] Sums shift_sums(const Signatures& signatures, std::size_t first, std::size_t slot,
                              std::size_t dimensions);

}  // namespace kilotwin::monitor
