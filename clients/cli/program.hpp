/// The common main function of `kilotwin` and `kilotwin-identify`.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/cli/commands.hpp"

namespace kilotwin::cli {

/// Parses the arguments, runs the command and returns the exit status. Prints an error as one line on stderr. `add_commands` adds the
/// commands to the parser that it receives.
[[nodiscard]] int run_program(int argc, char** argv, const std::string& description,
                              const std::function<std::vector<Command>(CLI::App&)>& add_commands);

}  // namespace kilotwin::cli
