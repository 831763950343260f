/// The poses that a tracker measured in one frame, and the writer that publishes them as topic kilotwin/tracker_frames.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/federation/topics.hpp"

namespace kilotwin::doors {

inline constexpr std::uint8_t kLedUnknown = 255;

/// A robot in a frame; fields as in idl/public.idl, positions in the arena's coordinates.
struct TrackedRobot {
  std::uint32_t robot = 0;
  std::uint8_t state = 0;  ///< 0: seen; 1: predicted; 2: lost; 3: identity in doubt
  double x_mm = 0, y_mm = 0;
  double heading_rad = 0;
  float xx_mm2 = 0, xy_mm2 = 0, yy_mm2 = 0;
  float heading_variance_rad2 = std::numeric_limits<float>::infinity();
  std::uint8_t led = kLedUnknown;                                              ///< r | g << 2 | b << 4
  float vx_mm_s = std::numeric_limits<float>::quiet_NaN(), vy_mm_s = vx_mm_s;  ///< NaN: not known
};

struct TrackedFrame {
  std::uint64_t frame = 0;
  std::int64_t capture_ns = 0;  ///< on the source's clock
  std::int64_t sent_ns = 0;     ///< on the same clock; 0: not known
  bool utc = false;             ///< the source's clock shows UTC
  std::vector<TrackedRobot> robots;
};

class FrameWriter {
 public:
  /// `source`: at most 64 characters. `channel`: tracker_frames(), or played_frames(), of which nothing is lost.
  FrameWriter(const dds::Participant& participant, std::string source,
              const dds::Channel& channel = topics::tracker_frames());
  /// Throws RunError where DDS refuses the sample.
  void write(const TrackedFrame& frame);
  /// Waits until every reader that acknowledges has all frames; false after `seconds`.
  [[nodiscard]] bool flush(double seconds) const { return writer_.flush(seconds); }
  /// How many readers are matched at the moment.
  [[nodiscard]] std::uint32_t readers() const { return writer_.readers(); }

 private:
  std::string source_;
  dds::Writer<PublicTrackerFrame> writer_;
};

}  // namespace kilotwin::doors
