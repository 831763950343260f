/// The moving picture of a run: SVG that a browser plays, in a page or by itself.
#pragma once

#include <string>

#include "clients/recorder/overview.hpp"

namespace kilotwin::recorder {

/// Robots as discs in their LED's colour, moving in a loop. A click or the space bar pauses it. Poses between recorded states
/// are interpolated. About 15 bytes per robot and frame. Empty if the run has no film or a single state.
[[nodiscard]] std::string animation_svg(const RunOverview& run);

}  // namespace kilotwin::recorder
