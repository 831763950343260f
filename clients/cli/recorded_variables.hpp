/// From the names of recorded variables to places in the programs' memories.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// The octets of the compiled programs. Throws std::runtime_error where one cannot be read.
[[nodiscard]] std::vector<std::string> contents_of(const std::vector<std::filesystem::path>& objects);

/// Finds recording.variable of the manifest's experiment in the debug information of its programs, and adds them to the manifest. `objects`:
/// the compiled programs, in the manifest's order. Throws UserError with the place where no program has a variable of that name, or
/// its path does not fit.
void add_recorded_variables(const LoadedExperiment& loaded, const std::vector<std::filesystem::path>& objects,
                            proto::Manifest& manifest);

/// Throws UserError with the place of the first observable of the experiment that has no name or whose expression cannot be read.
/// `manifest`: with its variables.
void check_observables(const LoadedExperiment& loaded, const proto::Manifest& manifest);

}  // namespace kilotwin::cli
