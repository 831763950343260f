/// What the filter had to correct, sample by sample: disturbances of the motion, for plots.
#pragma once

#include <nlohmann/json.hpp>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// One correction of the pose, as speeds over the time since the sample before.
struct Disturbance {
  double time_s, x_mm, y_mm, heading_rad;
  double since_command_s, motor_s, nearest_mm;
  double forward_mm_s, sideways_mm_s, turn_rad_s, world_x_mm_s, world_y_mm_s;
  std::uint32_t track;
};

/// Of all tracks, while robots are driven and touch nothing.
[[nodiscard]] std::vector<Disturbance> disturbances_of(const MotionModel&, const PreparedSet&,
                                                       std::uint32_t threads);

/// The report's covariate_plots (identify.hpp).
[[nodiscard]] nlohmann::json covariate_plots(const std::vector<Disturbance>& before,
                                             const std::vector<Disturbance>& after);
/// The report's maps.
[[nodiscard]] nlohmann::json maps(const std::vector<Disturbance>& before, const std::vector<Disturbance>& after);

}  // namespace kilotwin::identify
