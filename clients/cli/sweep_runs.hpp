/// Many runs, each a process of its own: programs are loaded at fixed addresses, one set per process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace kilotwin::cli {

struct SweepRun {
  std::size_t point = 0;
  std::uint64_t seed = 0;
  std::filesystem::path directory;  ///< of the run; what it says goes to directory + ".log"
  std::vector<std::string> words;   ///< its command line
  bool well = false;                ///< it ended with status 0
};

/// Starts `at_a_time` runs, a next one as each ends, and calls `ended` with each, until all have ended or the process is
/// interrupted; then those that run are told to end, and false is returned. `progress` is shown on a terminal.
[[nodiscard]] bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time,
                           const std::function<void(const SweepRun&)>& ended);

/// Why a run failed: the last line that it said.
[[nodiscard]] std::string last_words(const SweepRun& run);

}  // namespace kilotwin::cli
