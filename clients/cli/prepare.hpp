/// From arguments to a run directory that every service can run from.
#pragma once

#include "clients/cli/run_arguments.hpp"
#include "clients/recorder/run_directory.hpp"
#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// The experiment with all overrides applied. Throws UserError.
[[nodiscard]] LoadedExperiment load_with_overrides(const RunArguments& arguments);

struct Prepared {
  recorder::RunDirectory directory;
  proto::Manifest manifest;
};

/// Checks everything, compiles the programs and writes the run directory. Nothing is left behind where it throws
/// (UserError for bad input).
[[nodiscard]] Prepared prepare(const RunArguments& arguments);

/// The manifest of a prepared directory. Throws UserError.
[[nodiscard]] proto::Manifest read_manifest(const recorder::RunDirectory& directory);

/// "3x2" -> {3, 2}. Throws UserError.
[[nodiscard]] std::pair<std::uint32_t, std::uint32_t> parse_partitions(const std::string& text);

}  // namespace kilotwin::cli
