/// The runs of a sweep, each a process of its own: programs are loaded at fixed addresses, one set per process.
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
  std::filesystem::path directory;  ///< of the run; its stdout and stderr go to directory + ".log"
  std::vector<std::string> words;   ///< its command line
  bool well = false;                ///< it ended with status 0
  std::string last_line;            ///< of its log: why it failed, if it did
};

/// Runs `at_a_time` runs at once until all have ended, and calls `ended` after each. Where this process is interrupted, the
/// runs that still run are ended, and it returns false. Shows its progress on
/// stderr.
[[nodiscard]] bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time,
                           const std::function<void(const SweepRun&)>& ended);

}  // namespace kilotwin::cli
