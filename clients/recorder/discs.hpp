/// Robots as they stand at one time.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "clients/recorder/paths.hpp"
#include "clients/recorder/view.hpp"

namespace kilotwin::recorder {

/// The rim of a robot that has failed.
inline constexpr std::string_view kFailedRim = "#d0021b";

/// The square of a Kilogrid's cell, as a part of the pitch: a line of the floor remains between two cells.
inline constexpr double kCellPart = 0.94;

/// Robots as discs in their LED's colour with a tick towards the heading; failed robots have a red rim. A disc is a line of
/// length 0 with round caps, as thick as the disc: ten bytes. Cells of a Kilogrid are squares below them; `cell_mm`: as in
/// RunOverview.
[[nodiscard]] std::string draw_robots(const Snapshot& at, const std::vector<double>& cell_mm, const View& view);

}  // namespace kilotwin::recorder
