/// Placement: the robots' poses at tick 0.
#pragma once

#include <cstdint>
#include <vector>

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Initial poses by robot id. Ids count through the groups in the order of the file.
struct PlacedRobots {
  std::vector<double> x_mm, y_mm;          ///< centres of the discs
  std::vector<double> heading_rad;         ///< in [-pi, pi)
  std::vector<std::uint32_t> group_count;  ///< robots per group
};

/// Validates the whole experiment and places its robots within the walls and without overlap. Random layouts are placed last and
/// avoid all other robots. A pure function of the experiment and the files that it names. Time and memory are linear in the number
/// of robots. Throws UserError.
[[nodiscard]] PlacedRobots place_robots(const LoadedExperiment& loaded);

/// The experiment with `count` stated in every group, which the manifest requires.
[[nodiscard]] proto::Experiment with_counts(const LoadedExperiment& loaded, const PlacedRobots& placed);

}  // namespace kilotwin
