/// Change points: effects that start or end at an instant.
#pragma once

#include <string>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Whether a covariate only rises in a run: run time, a motor-on time, the number of commands.
[[nodiscard]] bool only_rises(const Axis&);

/// Whether a term is a drift of the robots in the world over time alone.
[[nodiscard]] bool is_drift_over_time(const Term&);

/// Whether a term is a motion of the image over time alone: it shifts, rotates or changes its scale.
[[nodiscard]] bool is_camera_over_time(const Term&);

/// Replaces a curve over such a covariate by steps at fitted change points, or adds steps to it, if the
/// evidence rises. A drift in the world may turn out to be a shift of the camera, or the reverse. Returns the name
/// of the resulting term. A curve that known factors multiply becomes steps only; its constant is a step before all data.
std::string find_change_points(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify
