/// Execution of a sweep's runs. Each run is a process, because robots' programs are loaded at fixed addresses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/run_arguments.hpp"
#include "clients/cli/sweep_points.hpp"

namespace kilotwin::cli {

struct SweepRun {
  std::size_t point = 0;
  std::uint64_t seed = 0;
  std::filesystem::path directory;  ///< run directory; stdout and stderr go to directory + ".log"
  std::vector<std::string> words;   ///< command line
  bool strict = false;              ///< a run in which robots failed counts as failed
  bool well = false;                ///< the process ended with status 0
  std::string last_line;            ///< last line of its log: the error if it failed
};

/// The command line of a local run of an experiment with overrides. `seed`: none for that of the experiment.
[[nodiscard]] std::vector<std::string> run_words(const RunArguments& arguments, const SweepPoint& point,
                                                 std::optional<std::uint64_t> seed,
                                                 const std::filesystem::path& directory);

/// Executes all runs, at most `at_a_time` at once, and calls `ended` after each. If this process is interrupted, it ends the active
/// runs and returns false. `shown`: progress on stderr.
[[nodiscard]] bool run_all(std::vector<SweepRun>& runs, std::size_t at_a_time,
                           const std::function<void(const SweepRun&)>& ended, bool shown = true);

}  // namespace kilotwin::cli
