/// Walls from the positions of robots that drive straight.
#pragma once

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// A side is a wall where robots that are driven stay at one line, some of them for seconds, and nobody is beyond.
[[nodiscard]] Room room_of(const PreparedSet&, const MotionModel&);

}  // namespace kilotwin::identify
