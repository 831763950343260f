// The program `kilotwin`: arguments in, exit status out. Every command is a file of its own: commands.hpp.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <vector>

#include "clients/cli/commands.hpp"
#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace {

/// What the arguments lack, in one line.
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

int main_of(int argc, char** argv) {
  const double started_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  CLI::App program{"Kilotwin simulates swarms of Kilobots as services over DDS. Start: kilotwin run EXPERIMENT"};
  program.name("kilotwin");
  program.require_subcommand(1);
  program.set_version_flag("--version", fmt::format("kilotwin {} ({})", build_identity(), build_compiler()));
  const std::vector<Command> commands{
      add_run(program, started_s), add_check(program),  add_build(program),    add_sweep(program),
      add_export(program),         add_replay(program), add_identify(program), add_service(program, started_s),
      add_config(program),         add_doctor(program)};
  // After the commands, which would inherit it.
  program.footer(
      "kilotwin COMMAND --help lists the options of a command. Exit status: 0 done, 1 the run or the check "
      "failed, 2 bad input or arguments.");
  try {
    program.parse(argc, argv);
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
}  // namespace kilotwin::cli

int main(int argc, char** argv) {
  using namespace kilotwin;
  // The next file to be opened would take the place of a closed stdin, stdout or stderr, and receive what is written there.
  for (int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDWR) < 0) return cli::kFailed;
  }
  try {
    return cli::main_of(argc, argv);
  } catch (const UserError& error) {
    say_error(error.what());
    return cli::kBadInput;
  } catch (const std::exception& error) {
    say_error(fmt::format("kilotwin: {}", error.what()));
    return cli::kFailed;
  }
}
