/// Where the robots stand at tick 0.
#pragma once

#include <cstdint>
#include <vector>

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Initial poses by robot id, which counts through the groups in the order of the file.
struct PlacedRobots {
  std::vector<double> x_mm, y_mm;          ///< centres of the discs
  std::vector<double> heading_rad;         ///< in [-pi, pi)
  std::vector<std::uint32_t> group_count;  ///< robots per group
};

/// Validates the experiment in full and places its robots: inside the walls, none over another. Random layouts come
/// last and keep clear of all others. A pure function of the experiment and the files it names; time and memory are
/// linear in the number of robots. Throws UserError.
[[nodiscard]] PlacedRobots place_robots(const LoadedExperiment& loaded);

/// The experiment with each group's count stated, as RunPlan and the manifest want it.
[[nodiscard]] proto::Experiment with_counts(const LoadedExperiment& loaded, const PlacedRobots& placed);

}  // namespace kilotwin
