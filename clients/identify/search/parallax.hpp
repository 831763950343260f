/// Parallax: robots of another height appear at another scale, about the foot of the camera.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// A term with a scale of the picture per robot: fits the point about which it scales, in place of the origin. Returns whether the
/// evidence rose; else the term stays as it is.
bool fit_camera_foot(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify
