/// Busy waits that work: `while (!received);` ends when an interrupt sets `received`, volatile or not.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// Preprocessed C or C++ in which every loop (while, do, for, and labels that a goto names) reads memory anew each time
/// round: the condition begins with a barrier for the compiler that costs no instruction. Everything stays on its line.
/// Text that it does not understand stays as it is; a condition that is a declaration (C++) as well.
[[nodiscard]] std::string with_loop_barriers(std::string_view preprocessed);

}  // namespace kilotwin::behaviours
