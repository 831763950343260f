/// The printed lines of a robot, for viewers: the last lines up to a time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace kilotwin::view {

inline constexpr std::size_t kMostLog_bytes = 8192;

/// The end of a log file of RobotLogs: lines that begin up to `until_s`, whole ones, kMostLog_bytes at most. Empty where there is no
/// such file or line. A log may grow meanwhile.
[[nodiscard]] std::string log_until(const std::filesystem::path& file, double until_s);

}  // namespace kilotwin::view
