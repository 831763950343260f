/// CaptureClock: when the pictures of a live source were taken, on the steady clock and in the time of what they show.
///
/// Pictures of `kilotwin cameras` carry a stamp. It tells the instant of capture, and the simulated time of the run. A run need not
/// keep the pace of real time: speeds of robots are right in simulated time only. Other pictures count as taken when they came.
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "clients/cameras/picture_file.hpp"
#include "clients/track/source.hpp"

namespace kilotwin::track {

/// The picture of a file that may be replaced at any time, and its stamp. An empty picture where it cannot be decoded.
struct StampedPicture {
  cv::Mat picture;
  std::optional<cameras::FrameStamp> stamp;
};
[[nodiscard]] StampedPicture read_stamped(const std::filesystem::path& file);

class CaptureClock {
 public:
  /// Sets `capture_ns` and `time_s` of the next frame, which has just come.
  void time(CapturedFrame& frame, const std::optional<cameras::FrameStamp>& stamp);

 private:
  std::optional<cameras::FrameStamp> stamp_;  ///< of the frame before
  std::optional<std::int64_t> capture_ns_;    ///< the same
  double time_s_ = 0;
};

}  // namespace kilotwin::track
