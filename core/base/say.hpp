/// Messages for users, on stderr. On a terminal they are plain lines; in a service's log each has a time stamp, the federate
/// and a level.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace kilotwin {

/// Writes `line` and a line end. If stderr is full or closed, the line is lost without an error.
void say(const std::string& line);
/// As say(), for warnings and for errors that end the program: a log shows them at their own level.
void warn(const std::string& line);
void say_error(const std::string& line);

/// Makes this process write a log: "[2026-11-22T21:30:12.123Z] [physics 0,0] [info] line", in UTC. The prefix "kilotwin: "
/// of a line is removed.
void log_as(const std::string& federate);

/// The text of a log's error line; empty for lines of other levels. A line without a time stamp is returned unchanged: the
/// process wrote it before log_as(), or in a crash.
[[nodiscard]] std::string_view error_text(std::string_view line);

/// `text` prepared for one line of a terminal: control characters become '?', and text beyond `longest` is cut in the middle.
[[nodiscard]] std::string one_line(std::string_view text, std::size_t longest = 4096);

}  // namespace kilotwin
