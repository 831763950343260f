/// Preparation of a run: from arguments to a run directory that all services read.
#pragma once

#include "clients/cli/run_arguments.hpp"
#include "clients/recorder/run_directory.hpp"
#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::cli {

/// The experiment with all overrides applied. Throws UserError.
[[nodiscard]] LoadedExperiment load_with_overrides(const RunArguments& arguments);

/// Whether the compiler's notes on programs are printed.
enum class Notes { kPrinted, kSilent };

struct Resolved {
  proto::Manifest manifest;
  std::vector<std::filesystem::path> objects;  ///< the compiled programs, in the manifest's order
  std::vector<std::filesystem::path> plugins;  ///< those of the station that have sources, and last what runs them
};
/// Makes all checks that are possible before a run: places robots, reads images and EEPROMs, compiles programs or takes them from the
/// cache. Writes nothing else. Throws UserError with the place of the first error.
[[nodiscard]] Resolved resolve(const LoadedExperiment& loaded, const RunArguments& arguments, Notes notes);

/// Writes the resolved programs and plugins into the run directory, and their sources for readers. Throws filesystem_error.
void write_programs(const LoadedExperiment& loaded, const Resolved& resolved,
                    const recorder::RunDirectory& directory);

struct Prepared {
  recorder::RunDirectory directory;
  proto::Manifest manifest;
};

/// Resolves the experiment and writes the run directory. If it throws (UserError for bad input), it leaves no files behind.
[[nodiscard]] Prepared prepare(const RunArguments& arguments);

/// The manifest of a prepared directory. Throws UserError.
[[nodiscard]] proto::Manifest read_manifest(const recorder::RunDirectory& directory);

/// Parses columns and rows: "3x2" gives {3, 2}. Throws UserError.
[[nodiscard]] std::pair<std::uint32_t, std::uint32_t> parse_partitions(const std::string& text);

}  // namespace kilotwin::cli
