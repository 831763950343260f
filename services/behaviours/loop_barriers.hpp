/// Makes busy waits end: `while (!received);` sees an interrupt's write to `received`, even if it is not volatile.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// Inserts a compiler barrier, which costs no instruction, into every loop of preprocessed C or C++: while, do, for, and labels of
/// goto. The loop then reads memory in each round. Lines keep their numbers. Text that the parser does not understand and C++
/// conditions that are declarations stay unchanged.
[[nodiscard]] std::string with_loop_barriers(std::string_view preprocessed);

}  // namespace kilotwin::behaviours
