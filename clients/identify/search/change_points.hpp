/// Where a cause acts from one instant to the next.
#pragma once

#include <string>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Puts steps at times of their own, of the run or for which motors have turned, in place of a curve over such time, or beside it, where that is more probable. A drift in the
/// room may turn out to be a shift of the picture, or the other way round. Returns the name of the term as it then is.
std::string find_steps(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify
