/// Tables of pogosim, and of `kilotwin export --pogosim`, as tracks and as an experiment that begins with their poses.
#pragma once

#include <filesystem>
#include <string>

#include "clients/importers/imported.hpp"

namespace kilotwin::importers {

struct ImportedTable {
  Imported imported;   ///< a group per category, with the poses of each robot's first row
  std::string tracks;  ///< trajectories.csv, as `kilotwin identify` reads it
};

/// Reads a table with the columns time (s), robot_category, robot_id, x, y (mm from the arena's corner) and maybe angle (rad): CSV, or
/// Arrow (.feather, .arrow). The arena's size is in the metadata that `kilotwin export` writes; else it is the least that holds all
/// positions. Throws UserError for other tables, and if there is no robot.
[[nodiscard]] ImportedTable from_pogosim_table(const std::filesystem::path& file);

}  // namespace kilotwin::importers
