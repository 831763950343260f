/// Robots whose wheels change at an instant: another motor, another robot under the same number.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Replaces changes of the turn rate or of the speed per robot, each from an instant on, by changes of the speed of each wheel, if
/// the evidence rises. A wheel may change under all commands that move the robot, or only while its own motor is on. Returns
/// whether they were replaced; the term then has another name.
bool replace_by_wheel_offsets(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify
