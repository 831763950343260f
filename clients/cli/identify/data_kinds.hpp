/// The kinds of measured data, behind one interface: trajectories, Kilogrid runs, bristle plate tracks, radio counts.
#pragma once

#include <filesystem>
#include <string>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

struct DataKind {
  const char* name;  ///< in the plural: "Kilogrid runs"
  /// Whether the directory holds data of this kind.
  bool (*holds)(const std::filesystem::path& directory);
  /// Reads, fits, searches, judges and reports. `test` may be empty; then a part of `train` is held out. `out`: the directory
  /// of the results, for files that only this kind has. Throws UserError on malformed files.
  identify::Identified (*identify)(const std::filesystem::path& train, const std::filesystem::path& test,
                                   const std::filesystem::path& out, const identify::Options&);
  bool has_draws;  ///< whether the result has draws from a posterior
};

/// The kind of the data at a path. Throws UserError if it holds none that is known; the line says what is there and what is
/// expected. `option`: the option that named the path.
[[nodiscard]] const DataKind& kind_of_data(const std::string& option, const std::filesystem::path& data);

}  // namespace kilotwin::cli
