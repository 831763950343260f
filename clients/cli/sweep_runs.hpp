/// Execution of a sweep's runs. Each run is a process, because robots' programs are loaded at fixed addresses.
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
  std::filesystem::path directory;  ///< run directory; stdout and stderr go to directory + ".log"
  std::vector<std::string> words;   ///< command line
  bool well = false;                ///< the process ended with status 0
  std::string last_line;            ///< last line of its log: the error if it failed
};

/// Executes all runs, at most `at_a_time` at once, and calls `ended` after each. If this process is interrupted, it ends the active
/// runs and returns false. Shows progress on stderr.
[[nodiscard]] bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time,
                           const std::function<void(const SweepRun&)>& ended);

}  // namespace kilotwin::cli
