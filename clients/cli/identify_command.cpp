// `kilotwin identify`: executes the program kilotwin-identify beside this one with the same arguments.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/commands.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

/// Replaces this process by kilotwin-identify. Throws RunError if it does not exist.
int become_identify(const std::vector<std::string>& arguments) {
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "kilotwin-identify";
  std::vector<std::string> words{"kilotwin", "identify"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  if (errno != ENOENT)
    throw RunError(
        fmt::format("{} cannot be started: {}", program.string(), std::generic_category().message(errno)));
  throw RunError(
      fmt::format("{} is not there; scripts/demo builds the simulator alone. Build the rest: "
                  "cmake --preset release && cmake --build --preset release",
                  program.string()));
}

}  // namespace

Command add_identify(CLI::App& program) {
  CLI::App& app =
      *program.add_subcommand("identify", "fit the model to measured data and find effects that it lacks");
  // kilotwin-identify parses the arguments, including --help.
  app.set_help_flag();
  app.prefix_command();
  return {&app, [&app] { return become_identify(app.remaining()); }};
}

}  // namespace kilotwin::cli
