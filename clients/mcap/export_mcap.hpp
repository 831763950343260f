/// A recording as an MCAP file that Foxglove, Lichtblick and Rerun open. Topics, all with time stamps of simulated time:
///   /scene      foxglove.SceneUpdate: walls, obstacles, movable bodies
///   /robots     foxglove.PointCloud: all robots, in the colours of their LEDs
///   /poses      foxglove.PosesInFrame: all robots, with headings
///   /counters   kilotwin.mcap.SwarmCounters: numbers for plots
///   /log        foxglove.Log: inputs of the run, and its end
#pragma once

#include <cstdint>
#include <filesystem>

#include "clients/recorder/reader.hpp"

namespace kilotwin::mcap {

/// From all remaining records of the recording; states at every multiple of `every_s`, or the first after it. Returns the number
/// of states. Throws RunError if the file cannot be written, UserError if the recording has no state.
std::uint64_t export_mcap(recorder::Reader& recording, const std::filesystem::path& file, double every_s);

}  // namespace kilotwin::mcap
