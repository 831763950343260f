/// The kinds of measured data, behind one interface: trajectories, Kilogrid runs, bristle plate tracks, radio counts.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "clients/identify/data/table_import.hpp"
#include "clients/identify/study.hpp"

namespace kilotwin::cli {

struct DataPlaces {
  std::filesystem::path train, test;  ///< directories; test empty: a part of `train` is held out
  std::filesystem::path out;          ///< of the results, for files that only one kind has
  /// Of the tables of another tracker, if options state it.
  std::optional<identify::TableFormat> format = {};
};

struct DataKind {
  const char* name;  ///< in the plural: "Kilogrid runs"
  /// Whether the directory holds data of this kind.
  bool (*holds)(const std::filesystem::path& directory);
  /// Throws UserError on malformed files.
  std::unique_ptr<identify::Study> (*read)(const DataPlaces&, const identify::Options&);
  bool has_draws;  ///< whether the result has draws from a posterior
};

/// The kind of the data at a path. Throws UserError if it holds none that is known; the line says what is there and what is
/// expected. `option`: the option that named the path.
[[nodiscard]] const DataKind& kind_of_data(const std::string& option, const std::filesystem::path& data);
/// The kind of tables whose format options state.
[[nodiscard]] const DataKind& kind_of_tables();

}  // namespace kilotwin::cli
