/// Forecasts: positions of robots one horizon ahead, given the measurements of a run up to an instant.
#pragma once

#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

struct Forecast {
  std::uint32_t run;    ///< index in the set
  std::uint32_t place;  ///< index of the track in its run
  double time_s;
  double x_mm, y_mm;
  double expected_error_mm;  ///< root mean square distance to the measurement that the filter itself expects
  /// Disc centre and heading at the start of the horizon, as estimated by the filter.
  double from_x_mm = 0, from_y_mm = 0, from_heading_rad = 0;
};

struct ForecastTimes {
  double first_s = 10, every_s = 5, horizon_s = 10;
  /// Number of joint Monte Carlo rollouts of robots that may touch; 0: mean paths only (fast).
  std::uint32_t rollouts = 0;
};

/// Forecasts for the times first_s, first_s + every_s, ... up to the last sample of each track. Each uses
/// measurements up to one horizon before, and commands after. `of`: the tracks to predict. All robots of a run advance together, so that neighbour effects act within the horizon.
[[nodiscard]] std::vector<Forecast> forecast(const MotionModel&, const PreparedSet&, const ForecastTimes&,
                                             Tracks of, std::uint32_t threads);

/// The forecasts of robots that stayed away from walls and from other robots over the whole horizon, by measured places.
[[nodiscard]] std::vector<Forecast> free_ones(const MotionModel&, const PreparedSet&, const std::vector<Forecast>&,
                                              double horizon_s);

/// The sample within 0.01 s of a time; false if there is none.
[[nodiscard]] bool measured_at(const Track&, double time_s, Sample&);

}  // namespace kilotwin::identify
