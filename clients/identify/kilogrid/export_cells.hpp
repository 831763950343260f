/// A recorded run as an instrumented floor would have written it down.
#pragma once

#include <cstdint>
#include <filesystem>

#include "clients/recorder/reader.hpp"

namespace kilotwin::kilogrid {

/// time_s,robot,x_mm,y_mm by time, then by robot: the cells that heard each robot, as the floor of docs/explanation/floors.md hears them. The floor
/// covers the arena; chance follows the run's seed. Returns the number of rows. Throws UserError where the arena is no whole
/// number of modules of 100 mm, or the run was recorded less often than every 2 s, and RunError where the file cannot be written.
std::uint64_t export_cells(recorder::Reader&, const std::filesystem::path& csv);

}  // namespace kilotwin::kilogrid
