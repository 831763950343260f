/// A recorded run as Kilogrid cell reports.
#pragma once

#include <cstdint>
#include <filesystem>

#include "clients/recorder/reader.hpp"

namespace kilotwin::kilogrid {

/// Writes time_s,robot,x_mm,y_mm by time, then by robot: the cells that receive each robot (FloorReporter). The
/// floor covers the arena. Random reception depends on the run's seed. Returns the number of rows. Throws
/// UserError if the arena is not a whole number of 100 mm modules or the recording interval exceeds 2 s, and
/// RunError if the file cannot be written.
std::uint64_t export_cells(recorder::Reader&, const std::filesystem::path& csv);

}  // namespace kilotwin::kilogrid
