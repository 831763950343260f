/// Filter corrections, sample by sample, as disturbances of the motion: data of the report's plots.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// One correction of the pose, divided by the time since the previous sample.
struct Disturbance {
  double time_s, x_mm, y_mm, heading_rad;
  double since_command_s, motor_s, nearest_mm;
  double forward_mm_s, sideways_mm_s, turn_rad_s, world_x_mm_s, world_y_mm_s;
  std::uint32_t track;
};

/// Of all tracks, for driven robots without contacts. The model estimates the initial headings itself.
[[nodiscard]] std::vector<Disturbance> disturbances_of(const FitState&, std::uint32_t threads);

}  // namespace kilotwin::identify
