/// Lines for people, on stderr.
#pragma once

#include <string>

namespace kilotwin {

/// Writes `line` and a line end. A stderr that is full or closed is no reason to fail: the line is then lost.
void say(const std::string& line);

}  // namespace kilotwin
