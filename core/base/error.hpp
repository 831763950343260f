/// Error reporting. There are three kinds of errors:
///   UserError     bad input or arguments: one line for the user, exit status 2
///   RunError      the run or a check failed: one line, exit status 1
///   KILOTWIN_DEMAND(condition)   an internal contract is broken, a defect: prints file and line, and aborts
#pragma once

#include <stdexcept>
#include <string>

namespace kilotwin {

/// "FILE:LINE:COLUMN: what is wrong; what would be right". The text is the whole line.
class UserError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class RunError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] void demand_failed(const char* condition, const char* file, int line);

}  // namespace kilotwin

#define KILOTWIN_DEMAND(condition) \
  ((condition) ? static_cast<void>(0) : ::kilotwin::demand_failed(#condition, __FILE__, __LINE__))
