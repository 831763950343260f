/// The direction in which robots carry their LED, learned from robots that drive straight.
///
/// The LED lies off the disc's centre, in the same direction from the heading on all robots of one kind. Once this direction is
/// known, a lit LED gives the heading at once, at rest too. The direction is the mode of the readings: robots that slide along a wall
/// seem to drive straight, and give readings of any direction.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

namespace kilotwin::track {

struct LedMount {
  double from_heading_rad = 0;  ///< anticlockwise from the heading
  double sd_rad = 0;            ///< of a heading that follows from one reading
};

class LedBearing {
 public:
  /// A reading of a robot whose heading follows from its path.
  void add(double bearing_rad, double heading_rad);
  /// Nothing before enough readings agree.
  [[nodiscard]] std::optional<LedMount> mount() const;

 private:
  static constexpr std::size_t kBins = 36;
  struct Bin {
    double count = 0, cos = 0, sin = 0;
  };
  std::array<Bin, kBins> bins_;
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
