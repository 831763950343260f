/// Forecasts: positions of robots one horizon ahead, given the measurements of a run up to an instant.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
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
  /// The instant of the sample nearest to time_s, at most kNear of the horizon away, and the position predicted for it.
  /// NaN: there is no such sample.
  double sample_s = std::numeric_limits<double>::quiet_NaN(), sample_x_mm = 0, sample_y_mm = 0;
};
/// Trackers need not sample at the predicted times: their frames may jitter, be shifted or be lost.
inline constexpr double kNear = 0.1;

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

/// The forecasts of one model with the expected errors that another model has of the same tracks and times. Forecasts that the other
/// lacks keep theirs.
[[nodiscard]] std::vector<Forecast> with_expectations_of(const std::vector<Forecast>& other,
                                                         std::vector<Forecast> forecasts);

/// The forecasts that start where the model knows the robot: it expects at most three times its median error. Before a heading is
/// known, errors are so large that they hide all others.
[[nodiscard]] std::vector<Forecast> from_known_starts(const std::vector<Forecast>&);

/// The sample nearest to a time, at most `reach_s` away; of two equally near ones the earlier. Null: none.
[[nodiscard]] const Sample* sample_near(const Track&, double time_s, double reach_s);

/// Measured minus predicted position at the sample of a forecast, mm; nothing if it has none.
[[nodiscard]] std::optional<Eigen::Vector2d> error_of(const Track&, const Forecast&);

}  // namespace kilotwin::identify
