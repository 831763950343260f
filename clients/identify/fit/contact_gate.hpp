/// What of a measurement tells of the model, by what the robot touched since the one before.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "clients/identify/fit/track_filter.hpp"

namespace kilotwin::identify {

/// Others that are in the way hold a robot back and push it aside, but do not turn it by more than the noise of touching allows
/// for: while it touches them, its heading tells how its wheels run. At walls, where robots stay for long, nothing is concluded.
class Touched {
 public:
  enum class Counts : std::uint8_t { kAll, kHeading, kNothing };

  void step(const StepRecord& record) {
    wall_ = wall_ || record.at_wall;
    robot_ = robot_ || record.at_robot;
  }
  /// Once for each measurement.
  [[nodiscard]] Counts update(const Innovation& innovation) {
    const bool wall = std::exchange(wall_, false), robot = std::exchange(robot_, false);
    if (wall || (robot && (innovation.size < 3 || innovation.lost))) return Counts::kNothing;
    return robot ? Counts::kHeading : Counts::kAll;
  }

 private:
  bool wall_ = false, robot_ = false;
};

/// Of the measured heading alone.
[[nodiscard]] inline double heading_log_likelihood(const Innovation& innovation) {
  const double variance = innovation.covariance(2, 2);
  return -0.5 * (std::log(variance) + innovation.difference[2] * innovation.difference[2] / variance);
}

}  // namespace kilotwin::identify
