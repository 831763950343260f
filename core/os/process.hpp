/// Runs another program to its end, without a shell.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::behaviours {

struct ProcessResult {
  int status = 0;      ///< exit status; 128 + signal where a signal ended it
  std::string output;  ///< what it wrote to standard output
  std::string errors;  ///< what it wrote to standard error
};

/// Runs arguments[0], a path, in the C locale and without the variables that redirect compilers (CPATH, GCC_EXEC_PREFIX...).
/// Throws RunError where it cannot be started.
[[nodiscard]] ProcessResult run_process(const std::vector<std::string>& arguments);

/// The first directory of $PATH that holds an executable of this name; empty where none does.
[[nodiscard]] std::filesystem::path find_executable(std::string_view name);

}  // namespace kilotwin::behaviours
