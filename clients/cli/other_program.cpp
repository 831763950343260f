#include "clients/cli/other_program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <filesystem>
#include <vector>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

int become(const std::string& name, const std::string& command, const std::vector<std::string>& arguments) {
  const std::filesystem::path program = program_beside(name);
  std::vector<std::string> words{"kilotwin", command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  throw RunError(fmt::format("{} cannot be started: {}", program.string(), std::generic_category().message(errno)));
}

}  // namespace

std::filesystem::path program_beside(const std::string& name) {
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  std::filesystem::path program = here / name, installed = here.parent_path() / "libexec/kilotwin" / name;
  if (std::filesystem::exists(program)) return program;
  if (std::filesystem::exists(installed)) return installed;
  throw RunError(
      fmt::format("{} is not there; scripts/demo builds the simulator alone. Build the rest: scripts/setup && "
                  "cmake --preset release && cmake --build --preset release",
                  program.string()));
}

std::filesystem::path main_program() {
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe"), here = self.parent_path();
  std::filesystem::path beside = here / "kilotwin", installed = here.parent_path().parent_path() / "bin/kilotwin";
  if (!self.filename().string().starts_with("kilotwin-")) return "/proc/self/exe";
  if (std::filesystem::exists(beside) && !std::filesystem::is_directory(beside)) return beside;
  if (std::filesystem::exists(installed)) return installed;
  throw RunError(fmt::format("the program kilotwin is neither {} nor {}", beside.string(), installed.string()));
}

Command add_other_program(CLI::App& app, const std::string& command, const std::string& description,
                          const std::string& program) {
  CLI::App& parser = *app.add_subcommand(command, description);
  // The other program parses the arguments.
  parser.set_help_flag();
  parser.prefix_command();
  return {&parser, [&parser, command, program] { return become(program, command, parser.remaining()); }};
}

}  // namespace kilotwin::cli
