/// The direction in which robots carry their LED, learned from robots that drive straight.
///
/// The LED lies off the disc's centre, in the same direction from the heading on all robots of one kind. Once this direction is
/// known, a lit LED gives the heading at once, at rest too. The direction is the mode of the readings, where a kernel makes
/// them densest: robots that slide along a wall seem to drive straight, and give readings of any direction.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/base/pose.hpp"

namespace kilotwin::track {

struct LedMount {
  double from_heading_rad = 0;  ///< anticlockwise from the heading
  double sd_rad = 0;            ///< of a heading that follows from one reading
};

/// Standard deviation of a robot's own direction about the common one, rad: robots are not built alike. An estimate; nothing
/// published states it.
inline constexpr double kRobotsDiffer_rad = 0.05;

class LedBearing {
 public:
  /// `known_rad`: the direction, if it is known; then no reading changes it.
  explicit LedBearing(std::optional<double> known_rad = std::nullopt);
  /// A reading of a robot whose heading follows from its path.
  void add(double bearing_rad, double heading_rad);
  /// Nothing before enough readings agree, unless it is known.
  [[nodiscard]] std::optional<LedMount> mount() const;

 private:
  static constexpr std::size_t kBins = 360;
  static constexpr double kBin_rad = 2 * kPi / kBins;
  /// The middle of a bin.
  static double offset_of(std::size_t bin) { return (static_cast<double>(bin) + 0.5) * kBin_rad - kPi; }
  [[nodiscard]] std::optional<LedMount> learned_mount() const;

  static constexpr double kEnough = 60;  ///< readings

  std::optional<double> known_rad_;
  std::optional<LedMount> learned_;
  std::array<double, kBins> counts_{};  ///< of readings less headings, by bins from -pi on
  double total_ = 0, next_ = kEnough;   ///< readings; and how many the next mount takes
};

/// The heading of a robot whose path over the last two seconds is straight; fed with each measured centre.
class StraightPath {
 public:
  void add(double time_s, double x_mm, double y_mm);
  /// Nothing unless the robot drove straight over the whole time.
  [[nodiscard]] std::optional<double> heading_rad() const;

 private:
  static constexpr int kPoints = 5;
  static constexpr double kEvery_s = 0.5;
  struct Place {
    double time_s, x_mm, y_mm;
  };
  Place places_[kPoints]{};
  int count_ = 0;
};

}  // namespace kilotwin::track
