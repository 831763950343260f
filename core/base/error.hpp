/// How errors are told. Three kinds, and no others:
///   UserError     bad input or arguments: one line for a person, exit status 2
///   RunError      the run or a check failed: one line, exit status 1
///   KILOTWIN_DEMAND(condition)   a promise between our own parts was broken: a defect; names file and line, aborts
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
