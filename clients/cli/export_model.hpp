/// Writes a run's model to a file. `run --model` with it gives robots with the same parameters.
#pragma once

#include <cstdint>
#include <filesystem>

#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// Writes the motion parameters and, if the experiment uses the PROPAGATION model, those of the radio, all with defaults. Also writes
/// the effects and every robot's parameters, including random draws. Returns the number of robots. Throws RunError if the file
/// cannot be written.
std::uint32_t export_model(const proto::Manifest&, const std::filesystem::path& file);

}  // namespace kilotwin::cli
