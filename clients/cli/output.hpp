/// Output directories of `run`, `sweep` and `identify`: the options --out and --force.
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
  bool force = false;         ///< replace an existing directory
};

/// `fallback`: description of the default, for --help.
void add_output_options(CLI::App& app, Output& output, const std::string& fallback);

/// Creates the output directory. A directory given with --out must be empty or new, unless --force replaces it. Without --out,
/// `fallback` gets a number if it exists, so that no result is lost. `inputs`: files that the command reads and must not replace;
/// empty paths are ignored. Throws UserError and RunError.
[[nodiscard]] recorder::RunDirectory make_output(const Output& output, const std::filesystem::path& fallback,
                                                 const std::vector<std::filesystem::path>& inputs);

/// The same for results of other commands than `run`: creates no files in the directory.
[[nodiscard]] std::filesystem::path make_plain_output(const Output& output, const std::filesystem::path& fallback,
                                                      const std::vector<std::filesystem::path>& inputs);

/// The text that gives the output directory, with the reason if it is not `fallback`.
[[nodiscard]] std::string place_in_words(const std::filesystem::path& used, const Output& output,
                                         const std::filesystem::path& fallback);

/// Prints a warning if `count` threads or processes exceed the number of cores.
void warn_beyond_cores(const std::string& option, std::uint32_t count);

}  // namespace kilotwin::cli
