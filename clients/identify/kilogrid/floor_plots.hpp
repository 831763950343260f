/// Statistics of the floor as plots and tables of the page.
#pragma once

#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"
#include "clients/identify/result/values.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::kilogrid {

/// The values of a group, null if unknown; `root`: their square roots.
[[nodiscard]] identify::JsonList numbers(const std::vector<double>& values, const StatisticGroup&, bool root);
/// A table of the main statistics of motion: measured on held-out runs, and simulated.
[[nodiscard]] identification::Table table_of_motion(const FloorTarget& held_out, const FloorStatistics& before,
                                                    const FloorStatistics& after);
/// covariate_plots, maps, distributions and msd on held-out runs, for the base model and the model with effects.
void add_plots(identification::Identification&, const FloorTarget& held_out, const FloorStatistics& before,
               const FloorStatistics& after);

}  // namespace kilotwin::kilogrid
