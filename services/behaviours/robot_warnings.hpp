/// Where a program would compute otherwise on the robot, whose int has 16 bits and whose double 32.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/behaviours/compiler.hpp"

namespace kilotwin::behaviours {

/// What avr-gcc warns of and the host's compiler, asked the same, does not: values that are cut, comparisons that are always
/// true, overflow in constants, formats of printf. Further products and shifts of 16 bits whose result is used with more.
/// Lines as compilers write them, "FILE:LINE:COLUMN: warning: on the robot ...", in the users' files only. Empty where this
/// machine has no avr-gcc, or avr-gcc does not compile the program.
[[nodiscard]] std::vector<std::string> robot_warnings(const std::vector<std::filesystem::path>& sources,
                                                      const CompileOptions& options = {});

/// Part of it, for tests: reads what `avr-gcc -fdump-tree-gimple-lineno` writes.
[[nodiscard]] std::vector<std::string> narrow_products(const std::string& gimple);

}  // namespace kilotwin::behaviours
