/// What the system lets this process have.
#pragma once

#include <cstdint>
#include <string>

namespace kilotwin {

/// Sees to it that this process may have `count` files and sockets open at a time: raises its limit as far as the system
/// allows. Throws RunError where that is too little; `what` begins the line, e.g. "a service".
void require_open_files(std::uint64_t count, const std::string& what);

}  // namespace kilotwin
