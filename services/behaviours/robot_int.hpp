/// Gives programs the integers of the robot: int and unsigned have 16 bits, long has 32. Values that are stored in an int wrap as on
/// the robot, and the line is reported.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// Replaces `int` by `short`, `unsigned` by `unsigned short` and `long` by `int` in preprocessed text. Headers of the runtime and of
/// the compiler keep theirs, and so do types with short, char or two times long. Literals lose a single L. Sums, differences and products are still computed with 32 bits. Where one is stored in an int, by =,
/// +=, -=, *=, ++ or --, or as initial value, the text gets a test that calls kilotwin_overflow() if 16 bits do not hold it.
/// Lines keep their numbers. Text that the parser does not understand stays without tests.
[[nodiscard]] std::string with_robot_int(std::string_view preprocessed);

/// Whether a program can get it: it hands no addresses of int to the C library.
[[nodiscard]] bool allows_robot_int(std::string_view preprocessed);

}  // namespace kilotwin::behaviours
