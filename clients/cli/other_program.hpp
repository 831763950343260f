/// Commands that are programs of their own, beside `kilotwin`: what simulates builds without them.
#pragma once

#include <filesystem>
#include <string>

#include "clients/cli/commands.hpp"

namespace kilotwin::cli {

/// A program in the folder of this one, or installed in ../libexec/kilotwin. Throws RunError where it is not there.
[[nodiscard]] std::filesystem::path program_beside(const std::string& name);

/// The program `kilotwin`: this one, or the one that this helper program belongs to. Throws RunError where it is not there.
[[nodiscard]] std::filesystem::path main_program();

/// Adds a command that starts `program` (from the folder of this one) with the same arguments, --help included. The work throws
/// RunError where it is not there.
[[nodiscard]] Command add_other_program(CLI::App& app, const std::string& command, const std::string& description,
                                        const std::string& program);

}  // namespace kilotwin::cli
