/// Robots as they stand at one time.
#pragma once

#include <string>
#include <string_view>

#include "clients/recorder/paths.hpp"
#include "clients/recorder/view.hpp"

namespace kilotwin::recorder {

/// The rim of a robot that has failed.
inline constexpr std::string_view kFailedRim = "#d0021b";

/// Robots as discs in their LED's colour with a tick towards the heading; failed robots have a red rim. A disc is a line of
/// length 0 with round caps, as thick as the disc: ten bytes.
[[nodiscard]] std::string draw_discs(const Snapshot& at, const View& view);

}  // namespace kilotwin::recorder
