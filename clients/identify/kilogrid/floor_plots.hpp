/// Statistics of the floor as the report draws them: the keys are those of clients/identify/identify.hpp.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

/// A group's row of values, null where there are none; roots of them where they are squares.
[[nodiscard]] nlohmann::json numbers(const std::vector<double>& values, const StatisticGroup&, bool root);
/// What a reader asks first of how robots move: measured on runs held out, and simulated. A table of the report.
[[nodiscard]] nlohmann::json table_of_motion(const FloorTarget& held_out, const FloorStatistics& before,
                                             const FloorStatistics& after);
/// covariate_plots, maps, distributions and msd: on runs held out, of the base model and of the one with effects.
void add_plots(nlohmann::json& document, const FloorTarget& held_out, const FloorStatistics& before,
               const FloorStatistics& after);

}  // namespace kilotwin::kilogrid
