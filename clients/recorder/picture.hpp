/// The picture of a run in three panels: start, paths and end of all robots.
#pragma once

#include <string>

#include "clients/recorder/overview.hpp"

namespace kilotwin::recorder {

/// SVG with three panels. Its size is about 100 to 250 bytes per robot for large swarms.
[[nodiscard]] std::string picture_svg(const RunOverview& run);

}  // namespace kilotwin::recorder
