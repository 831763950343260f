/// Detection of walls from the positions of robots that drive straight.
#pragma once

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// A side has a wall if driven robots accumulate at a line, some of them for seconds, and none is beyond it. If three sides have
/// one, the fourth may have been reached by none: in an arena about the origin it mirrors the opposite one.
[[nodiscard]] Walls detected_walls(const PreparedSet&, const MotionModel&);

/// Adds the one side of four that has no wall yet, if the others imply it: it mirrors the opposite one in an arena about the
/// origin. `reached`: how far disc centres went towards each side, outliers left out; a side that they went beyond stays open.
void add_implied_side(Walls&, const Walls& reached);

}  // namespace kilotwin::identify
