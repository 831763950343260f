/// Origin of a run: the program, date, command line and machine that prepared it. File provenance.json of a run directory. No
/// result depends on it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::recorder {

struct Provenance {
  std::string version;                    ///< of the program
  std::string build;                      ///< identity of the build
  std::string date;                       ///< UTC, ISO 8601: 2026-11-22T21:25:00Z
  std::vector<std::string> command_line;  ///< one entry per word, the program first
  std::string host;                       ///< the machine's name
  unsigned cores = 0;                     ///< number of the machine's cores
};

/// Provenance of runs that this process prepares.
[[nodiscard]] Provenance provenance_of_this_process();

/// Throws RunError.
void write_provenance(const Provenance& provenance, const std::filesystem::path& file);
/// Returns nullopt if the file does not exist. Throws UserError if it is of another kind.
[[nodiscard]] std::optional<Provenance> read_provenance(const std::filesystem::path& file);

}  // namespace kilotwin::recorder
