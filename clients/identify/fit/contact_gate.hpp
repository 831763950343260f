/// Gating of measurements after contacts: which parts of an innovation enter the likelihood.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "clients/identify/fit/track_filter.hpp"

namespace kilotwin::identify {

/// A robot in contact with another robot is slowed and displaced, but its heading still follows its wheels, within
/// the contact noise: the fit uses the heading alone. Contacts with walls last long, and the fit uses nothing. The same holds where a
/// spell of stalls starts or ends.
class ContactGate {
 public:
  enum class Counts : std::uint8_t { kAll, kHeading, kNothing };

  void step(const StepRecord& record) {
    wall_ = wall_ || record.at_wall || record.spell_unsure;
    robot_ = robot_ || record.at_robot;
  }
  /// To be called once per measurement.
  [[nodiscard]] Counts update(const Innovation& innovation) {
    const bool wall = std::exchange(wall_, false), robot = std::exchange(robot_, false);
    if (wall || (robot && (innovation.size < 3 || innovation.lost))) return Counts::kNothing;
    return robot ? Counts::kHeading : Counts::kAll;
  }

 private:
  bool wall_ = false, robot_ = false;
};

/// Log likelihood of the measured heading alone.
[[nodiscard]] inline double heading_log_likelihood(const Innovation& innovation) {
  const double variance = innovation.covariance(2, 2);
  return -0.5 * (std::log(variance) + innovation.difference[2] * innovation.difference[2] / variance);
}

}  // namespace kilotwin::identify
