/// What is tested of single robots, and of all of them together.
#pragma once

#include <span>

#include "clients/monitor/evidence.hpp"
#include "clients/monitor/signatures.hpp"

namespace kilotwin::monitor {

/// Groups of columns whose dispersion is learned together.
enum class Group : std::uint8_t { kGain, kBias, kHeading, kDrift, kShift, kCount };

struct Hypothesis {
  Suspect suspect;
  Group group;
  SizePrior prior;
};

/// Which grid the hypothesis' starts are of.
[[nodiscard]] constexpr Family family_of(Group group) {
  return group == Group::kHeading || group == Group::kShift ? Family::kAbsorbed : Family::kLasting;
}

/// Of a single robot.
[[nodiscard]] std::span<const Hypothesis> robot_hypotheses();
/// Of all robots: gain and drift; calibration shifts; patches.
[[nodiscard]] const Hypothesis& gain_of_all();
[[nodiscard]] const Hypothesis& drift_of_all();
[[nodiscard]] const Hypothesis& calibration_shift();
[[nodiscard]] const Hypothesis& patch();

/// The sums of a hypothesis of a robot, from a slot on.
[[nodiscard]] Sums sums_of(Suspect suspect, const Signatures& signatures, std::size_t slot, double wheel_base_mm);
/// Of a shift in the columns from `first` on.
[[nodiscard]] Sums shift_sums(const Signatures& signatures, std::size_t first, std::size_t slot,
                              std::size_t dimensions);

}  // namespace kilotwin::monitor
