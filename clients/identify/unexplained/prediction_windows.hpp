/// Prediction errors with the covariates of their windows: from the last measurement used to the predicted time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "clients/identify/predict/forecast.hpp"

namespace kilotwin::identify {

/// Covariates of a window, at its start unless stated otherwise.
enum class Feature : std::uint8_t {
  kTime,          ///< of the run, s
  kDrivenTime,    ///< for which either motor was on, s
  kX,             ///< mm
  kY,             ///< mm
  kHeading,       ///< estimated by the model, rad
  kCommand,       ///< the command that lasts longest in the window, as Motion
  kStraight,      ///< share of the window under this command
  kTurning,       ///< share of the window in left turns, minus that in right turns
  kSinceCommand,  ///< s
  kNearest,       ///< distance to the nearest robot, mm, at most kFarNeighbour_mm
  kBearing,       ///< direction to the nearest robot, from the heading, rad
  kRobot          ///< robot number
};
inline constexpr std::size_t kFeatures = 12;
/// Distance from which on a neighbour counts as none; a larger value counts more of them.
inline constexpr double kFarNeighbour_mm = 200;

/// Name as in result.json, unit, and name for people.
[[nodiscard]] const char* name_of(Feature);
[[nodiscard]] const char* unit_of(Feature);
[[nodiscard]] const char* in_words(Feature);

struct Window {
  std::uint32_t run = 0, place = 0;  ///< of the track, as in Forecast
  std::array<double, kFeatures> at = {};
  Eigen::Vector2d in_body_mm,
      in_world_mm;  ///< measured minus predicted: ahead and left of the heading; along x and y

  [[nodiscard]] double operator[](Feature feature) const { return at[static_cast<std::size_t>(feature)]; }
};

/// The windows of forecasts that have a measurement at their time.
[[nodiscard]] std::vector<Window> windows_of(const PreparedSet&, const std::vector<Forecast>&, double horizon_s);

}  // namespace kilotwin::identify
