/// An entry of a tracker's sample in the arena's frame.
#pragma once

#include <cstdint>

#include "core/frames/tracker_sample.hpp"
#include "core/plan/tracking_settings.hpp"

namespace kilotwin {

/// A heading with a larger variance is none, rad^2.
inline constexpr double kNoHeading_rad2 = 10;

/// One tracker's measurement of one robot.
struct MeasuredPose {
  std::int64_t cycle = 0;
  double x_mm = 0, y_mm = 0, xx = 0, xy = 0, yy = 0;
  double heading_rad = 0;
  double heading_variance = 0;  ///< above kNoHeading_rad2: none
  std::uint8_t led = 0;
  bool in_doubt = false;

  [[nodiscard]] bool has_heading() const { return heading_variance < kNoHeading_rad2; }
  /// False: no robot of any arena is there.
  [[nodiscard]] bool is_near() const;
};

/// Samples farther from the centre are no robots': arenas are at most 1e6 mm wide.
inline constexpr double kFarthestSample_mm = 1e7;

/// The settings of a source; those of a tracker without a block where the experiment has none for it.
[[nodiscard]] TrackerSettings tracker_of(const TrackingSettings&, std::uint32_t source);

/// Entry `n` of the sample. A stated covariance counts within sane bounds, else that of the settings.
[[nodiscard]] MeasuredPose measured_pose(const TrackerSettings&, const TrackerSample&, std::size_t n);

}  // namespace kilotwin
