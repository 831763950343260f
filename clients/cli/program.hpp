/// What the programs `kilotwin` and `kilotwin-identify` share: from arguments to an exit status.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/cli/commands.hpp"

namespace kilotwin::cli {

/// Parses the arguments, runs the command that they name and returns the exit status. Prints every error as one line on stderr.
/// `add_commands` adds the commands to the parser that it is given.
[[nodiscard]] int run_program(int argc, char** argv, const std::string& description,
                              const std::function<std::vector<Command>(CLI::App&)>& add_commands);

}  // namespace kilotwin::cli
