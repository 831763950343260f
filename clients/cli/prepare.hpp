/// From arguments to a run directory that every service can run from.
#pragma once

#include "clients/cli/run_arguments.hpp"
#include "clients/recorder/run_directory.hpp"
#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// The experiment with all overrides applied. Throws UserError.
[[nodiscard]] LoadedExperiment load_with_overrides(const RunArguments& arguments);

/// Whether the compiler's notes on programs are shown.
enum class Notes { kSaid, kSilent };

struct Resolved {
  proto::Manifest manifest;
  std::vector<std::filesystem::path> objects;  ///< the compiled programs, in the manifest's order
};
/// Checks everything that can be checked before a run: places robots, reads images and EEPROMs, compiles programs (once:
/// results are cached). Writes nothing. Throws UserError with the place of the first error.
[[nodiscard]] Resolved resolve(const LoadedExperiment& loaded, const RunArguments& arguments, Notes notes);

struct Prepared {
  recorder::RunDirectory directory;
  proto::Manifest manifest;
};

/// Resolves the experiment and writes the run directory. Nothing is left behind where it throws
/// (UserError for bad input).
[[nodiscard]] Prepared prepare(const RunArguments& arguments);

/// The manifest of a prepared directory. Throws UserError.
[[nodiscard]] proto::Manifest read_manifest(const recorder::RunDirectory& directory);

/// "3x2" -> {3, 2}. Throws UserError.
[[nodiscard]] std::pair<std::uint32_t, std::uint32_t> parse_partitions(const std::string& text);

}  // namespace kilotwin::cli
