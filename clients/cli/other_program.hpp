/// Commands that are programs of their own, beside `kilotwin`: what simulates builds without them.
#pragma once

#include <string>

#include "clients/cli/commands.hpp"

namespace kilotwin::cli {

/// Adds a command that starts `program` (from the folder of this one) with the same arguments, --help included. The work throws
/// RunError where it is not there.
[[nodiscard]] Command add_other_program(CLI::App& app, const std::string& command, const std::string& description,
                                        const std::string& program);

}  // namespace kilotwin::cli
