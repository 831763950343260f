#include "clients/cli/program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <string_view>

#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace {

/// The error line about wrong arguments.
std::string complaint(const CLI::App& program, const CLI::ParseError& error, int argc, char** argv) {
  const std::vector<CLI::App*> given = program.get_subcommands();
  if (!given.empty())
    return fmt::format("kilotwin: {}; see kilotwin {} --help", error.what(), given.front()->get_name());
  if (argc < 2 || argv[1][0] == '-') return fmt::format("kilotwin: {}; see kilotwin --help", error.what());
  std::string known;
  for (const CLI::App* command : program.get_subcommands(nullptr))
    known += (known.empty() ? "" : ", ") + command->get_name();
  return fmt::format("kilotwin: \"{}\" is no command; there are {}; see kilotwin --help", argv[1], known);
}

/// `--define A=1 B=2`: each word of the form NAME=VALUE that follows a macro is a macro too, unless there is such a file. The
/// words in reverse order, as CLI11 takes them.
std::vector<std::string> words_of(int argc, char** argv) {
  const auto is_macro = [](std::string_view word) {
    const std::string_view name = word.substr(0, word.find('='));
    std::error_code ignored;
    return name.size() < word.size() && !name.empty() &&
           name.find_first_not_of(
               "abcdefghijklmnopqrstuvwxyz"
               "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
               "0123456789_") == std::string_view::npos &&
           !std::filesystem::exists(word, ignored);
  };
  std::vector<std::string> words;
  bool after_macro = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool follows_option = i > 1 && std::string_view(argv[i - 1]) == "--define";
    if (after_macro && !follows_option && is_macro(word)) words.emplace_back("--define");
    after_macro = follows_option || word.starts_with("--define=") || (after_macro && is_macro(word));
    words.emplace_back(word);
  }
  std::reverse(words.begin(), words.end());
  return words;
}

int parse_and_run(int argc, char** argv, const std::string& description,
                  const std::function<std::vector<Command>(CLI::App&)>& add_commands) {
  CLI::App program{description};
  program.name("kilotwin");
  program.require_subcommand(1);
  program.set_version_flag("--version", fmt::format("kilotwin {} ({})", build_identity(), build_compiler()));
  const std::vector<Command> commands = add_commands(program);
  // Set after the commands are added, because they would inherit it.
  program.footer(
      "kilotwin COMMAND --help lists the options of a command. Exit status: 0 done, 1 the run or the check "
      "failed, 2 bad input or arguments.");
  try {
    program.parse(words_of(argc, argv));
  } catch (const CLI::Success& success) {
    return program.exit(success);
  } catch (const CLI::ParseError& error) {
    say_error(complaint(program, error, argc, argv));
    return kBadInput;
  }
  for (const Command& command : commands) {
    if (command.parser->parsed()) return command.work();
  }
  return kBadInput;  // not reached: the parser requires a command
}

}  // namespace

int run_program(int argc, char** argv, const std::string& description,
                const std::function<std::vector<Command>(CLI::App&)>& add_commands) {
  // If stdin, stdout or stderr is closed, the next file that is opened would get its descriptor and receive the program's output.
  for (int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDWR) < 0) return kFailed;
  }
  try {
    return parse_and_run(argc, argv, description, add_commands);
  } catch (const UserError& error) {
    say_error(error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    say_error(fmt::format("kilotwin: {}", error.what()));
    return kFailed;
  }
}

}  // namespace kilotwin::cli
