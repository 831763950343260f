/// The model of a run as a file. `run --model` reads it and gives the same robots.
#pragma once

#include <cstdint>
#include <filesystem>

#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// Writes the parameters of motion, and of the radio's propagation where the experiment uses that, with all defaults; the
/// effects; and the parameters of every robot, drawn ones included. Returns the number of
/// robots. Throws RunError where the file cannot be written.
std::uint32_t export_model(const proto::Manifest&, const std::filesystem::path& file);

}  // namespace kilotwin::cli
