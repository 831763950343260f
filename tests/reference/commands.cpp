#include "tests/reference/commands.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace kilotwin::reference {
namespace {

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe{popen(command.c_str(), "r"), &pclose};
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t got = std::fread(part.data(), 1, part.size(), pipe.get())) text.append(part.data(), got);
  if (text.empty()) throw std::runtime_error(command + " printed nothing");
  return text;
}

/// Names of the commands: the first words of the indented lines under "Subcommands:".
std::vector<std::string> command_names(const std::string& help) {
  std::istringstream lines{help.substr(std::min(help.find("Subcommands:"), help.size()))};
  std::vector<std::string> names;
  std::string line;
  for (std::getline(lines, line); std::getline(lines, line);) {
    if (line.size() < 3 || !line.starts_with("  ") || line[2] == ' ') continue;
    names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  if (names.empty()) throw std::runtime_error("the program's help lists no commands");
  return names;
}

std::string block(std::string help) {
  while (!help.empty() && help.back() == '\n') help.pop_back();
  help.erase(0, help.find_first_not_of('\n'));
  return fmt::format("\n```text\n{}\n```\n", help);
}

}  // namespace

std::string commands_help(const std::filesystem::path& program) {
  // The folder is left, so that the usage line shows the bare name.
  const std::string call =
      fmt::format("cd '{}' && COLUMNS=100 ./{} ", program.parent_path().string(), program.filename().string());
  const std::string help = output_of(call + "--help");
  std::string page = block(help);
  for (const std::string& name : command_names(help))
    page += fmt::format("\n## kilotwin {}\n", name) + block(output_of(call + name + " --help"));
  return page + "\n";
}

}  // namespace kilotwin::reference
