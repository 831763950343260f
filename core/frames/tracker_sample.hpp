/// One camera frame of a tracker, or what listeners heard, stamped by the ingress: an input of the frames of one tick.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/overhead_packet.hpp"

namespace kilotwin {

/// A message of a real robot that a listener, another real robot, heard. HeardMessage of idl/public.idl says what the fields
/// mean.
struct HeardMessage {
  static constexpr std::uint32_t kUnknown = 0xffffffffu;
  std::uint32_t robot = kUnknown;     ///< the sender, a tracked robot of the plan
  std::uint32_t listener = kUnknown;  ///< a tracked robot of the plan
  float distance_mm = -1;
  IrMessage message{};
};

/// Columns have one entry per robot in the tracker's frame: tracked robots of the plan, each at most once. Lengths are the
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
  std::vector<HeardMessage> heard;  ///< in the order of arrival; a sample has these or robots
};

}  // namespace kilotwin
