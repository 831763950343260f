#include "core/trackers/measured_pose.hpp"

#include <algorithm>

#include "core/base/pose.hpp"
#include "core/frames/frames.hpp"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

/// Bounds of what a tracker may state as variances.
constexpr double kLeastVariance_mm2 = 1e-4, kMostVariance_mm2 = 1e6, kLeastVariance_rad2 = 1e-6;

}  // namespace

bool MeasuredPose::is_near() const {
  return x_mm > -kFarthestSample_mm && x_mm < kFarthestSample_mm && y_mm > -kFarthestSample_mm &&
         y_mm < kFarthestSample_mm;
}

TrackerSettings tracker_of(const TrackingSettings& settings, std::uint32_t source) {
  return source < settings.trackers.size() ? settings.trackers[source] : TrackerSettings{};
}

MeasuredPose measured_pose(const TrackerSettings& tracker, const TrackerSample& sample, std::size_t n) {
  const double c = tracker.scale * kt_cos(tracker.heading_rad), s = tracker.scale * kt_sin(tracker.heading_rad);
  const double side = tracker.mirrored ? -1 : 1;
  const double u = sample.x[n], v = side * sample.y[n];
  MeasuredPose measured;
  measured.cycle = sample.capture_cycle;
  measured.x_mm = tracker.x_mm + c * u - s * v;
  measured.y_mm = tracker.y_mm + s * u + c * v;
  const double uu = sample.xx[n], uv = side * sample.xy[n], vv = sample.yy[n];
  if (uu > 0 && vv > 0 && uv * uv < uu * vv) {
    measured.xx = c * c * uu - 2 * c * s * uv + s * s * vv;
    measured.yy = s * s * uu + 2 * c * s * uv + c * c * vv;
    measured.xy = c * s * (uu - vv) + (c * c - s * s) * uv;
  } else {
    measured.xx = measured.yy = tracker.position_sd_mm * tracker.position_sd_mm;
  }
  measured.xx = std::clamp(measured.xx, kLeastVariance_mm2, kMostVariance_mm2);
  measured.yy = std::clamp(measured.yy, kLeastVariance_mm2, kMostVariance_mm2);
  measured.heading_rad = wrapped(kt_fmod(side * sample.heading_rad[n] + tracker.heading_rad, 2 * kPi));
  const double stated = sample.heading_variance_rad2[n];
  measured.heading_variance =
      stated > 0 ? std::max(stated, kLeastVariance_rad2) : tracker.heading_sd_rad * tracker.heading_sd_rad;
  measured.led = sample.led[n];
  measured.in_doubt = TrackedState{sample.state[n]} == TrackedState::kInDoubt;
  return measured;
}

}  // namespace kilotwin
