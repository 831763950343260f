/// Where `run`, `sweep` and `identify` write: the options --out and --force.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/recorder/run_directory.hpp"

namespace CLI {
class App;
}

namespace kilotwin::cli {

struct Output {
  std::filesystem::path out;  ///< empty: the command's default
  bool force = false;         ///< replace the directory where it exists
};

/// `fallback`: the default in words, for --help.
void add_output_options(CLI::App& app, Output& output, const std::string& fallback);

/// Makes the directory to write to. One that is named with --out must be empty or new, unless --force replaces it; where
/// none is named, `fallback` gets a number if it is taken, so that no result is lost. `inputs`: what the command reads,
/// and must not replace; empty paths are ignored. Throws UserError and RunError.
[[nodiscard]] recorder::RunDirectory make_output(const Output& output, const std::filesystem::path& fallback,
                                                 const std::vector<std::filesystem::path>& inputs);

/// The same for results that are no run: the directory is empty.
[[nodiscard]] std::filesystem::path make_plain_output(const Output& output, const std::filesystem::path& fallback,
                                                      const std::vector<std::filesystem::path>& inputs);

/// The line that says where the results are, and why there if another directory was expected.
[[nodiscard]] std::string place_in_words(const std::filesystem::path& used, const Output& output,
                                         const std::filesystem::path& fallback);

/// Warns in one line where `count` threads or processes have fewer cores.
void warn_beyond_cores(const std::string& option, std::uint32_t count);

}  // namespace kilotwin::cli
