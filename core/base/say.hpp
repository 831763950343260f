/// Lines for people, on stderr. A user's terminal gets the lines alone; a service's log gets them with time stamp, federate and
/// level.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace kilotwin {

/// Writes `line` and a line end. A stderr that is full or closed is no reason to fail: the line is then lost.
void say(const std::string& line);
/// The same for what needs attention, and for what ended the work: in a log these lines have another level.
void warn(const std::string& line);
void say_error(const std::string& line);

/// From now on this process writes a log: "[2026-11-22T21:30:12.123Z] [physics 0,0] [info] line", in UTC. A line's prefix
/// "kilotwin: " is left out.
void log_as(const std::string& federate);

/// The text of an error line of a log; nothing for its other lines. A line without a stamp is taken as it is: the process wrote
/// it before it was a service, or in a crash.
[[nodiscard]] std::string_view error_text(std::string_view line);

/// `text` made fit for one line of a terminal: control characters as '?', the middle of what is overlong cut out.
[[nodiscard]] std::string one_line(std::string_view text, std::size_t longest = 4096);

}  // namespace kilotwin
