/// Warnings for code that computes something else on the robot, where int has 16 bits and double has 32.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/behaviours/compiler.hpp"

namespace kilotwin::behaviours {

/// Warnings that avr-gcc gives and the host's compiler with the same options does not: truncated values, comparisons that are always
/// true, overflow in constants, formats of printf. Also 16-bit products and shifts whose result is used with more bits.
/// Each line is "FILE:LINE:COLUMN: warning: on the robot ..." and is about a file of the user. Empty if this machine has no avr-gcc
/// or avr-gcc does not compile the program.
[[nodiscard]] std::vector<std::string> robot_warnings(const std::vector<std::filesystem::path>& sources,
                                                      const CompileOptions& options = {});

/// robot_warnings() and the compiler's own warnings about a program of this hash. `sources`: CompiledProgram::sources. Kept in the
/// cache, so that runs can show them.
[[nodiscard]] std::vector<std::string> program_warnings(const std::vector<std::filesystem::path>& sources,
                                                        const std::string& sha256,
                                                        const CompileOptions& options = {});

/// Finds the 16-bit products and shifts in the output of `avr-gcc -fdump-tree-gimple-lineno`. Exposed for tests.
[[nodiscard]] std::vector<std::string> narrow_products(const std::string& gimple);

}  // namespace kilotwin::behaviours
