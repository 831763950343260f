/// Statistics of the floor as plot data and tables. Keys as in clients/identify/identify.hpp.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

/// The values of a group, null if unknown; `root`: their square roots.
[[nodiscard]] nlohmann::json numbers(const std::vector<double>& values, const StatisticGroup&, bool root);
/// A table of the main statistics of motion: measured on held-out runs, and simulated.
[[nodiscard]] nlohmann::json table_of_motion(const FloorTarget& held_out, const FloorStatistics& before,
                                             const FloorStatistics& after);
/// covariate_plots, maps, distributions and msd on held-out runs, for the base model and the model with effects.
void add_plots(nlohmann::json& document, const FloorTarget& held_out, const FloorStatistics& before,
               const FloorStatistics& after);

}  // namespace kilotwin::kilogrid
