/// One camera frame of a tracker, stamped by the ingress: an input of the frames of one tick.
#pragma once

#include <cstdint>
#include <vector>

namespace kilotwin {

/// Columns have one entry per robot that the tracker told of: tracked robots of the plan, each at most once. Lengths are the
/// tracker's own; TrackerFrame of idl/public.idl says what the columns mean.
struct TrackerSample {
  std::uint32_t source = 0;  ///< index in TrackingSettings::trackers, or in the order of their first samples
  std::uint64_t frame = 0;
  std::int64_t capture_cycle = 0;  ///< simulated time of the exposure, cycles since the start
  std::vector<std::uint32_t> robot;
  std::vector<std::uint8_t> state;  ///< TrackedState
  std::vector<float> x, y, heading_rad;
  std::vector<float> xx, xy, yy, heading_variance_rad2;
  std::vector<std::uint8_t> led;
};

}  // namespace kilotwin
