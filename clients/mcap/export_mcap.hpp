/// A recording as an MCAP file that Foxglove, Lichtblick and Rerun open, with the topics of clients/foxglove/topics.hpp.
#pragma once

#include <cstdint>
#include <filesystem>

#include "clients/recorder/reader.hpp"

namespace kilotwin::mcap {

/// From all remaining records of the recording; states at every multiple of `every_s`, or the first after it. Returns the number
/// of states. Throws RunError if the file cannot be written, UserError if the recording has no state.
std::uint64_t export_mcap(recorder::Reader& recording, const std::filesystem::path& file, double every_s);

}  // namespace kilotwin::mcap
