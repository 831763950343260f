/// PictureTracker: pictures in, tracks out.
///
/// Each frame looks for every known robot near where it is predicted. Beside that, it searches a strip of the picture for robots
/// that are not known; some frames together search all of it. The cost of a frame is therefore even.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "clients/track/detect.hpp"
#include "clients/track/floor_map.hpp"
#include "clients/track/follow.hpp"

namespace kilotwin::track {

/// A robot after one frame.
struct TrackedRobot {
  std::uint32_t track = 0;
  std::optional<std::uint16_t> number;  ///< of the robot itself; known after an identification
  TrackState state = TrackState::kSeen;
  Circle disc;                     ///< as seen, or where it is predicted
  FloorPoint position;             ///< filtered
  Covariance covariance;           ///< mm^2
  std::optional<Heading> heading;  ///< on the floor
  Led led = Led::kOff;
  bool led_known = true;  ///< false: the robot is not seen
};

class PictureTracker {
 public:
  /// Without `floor` the scale follows from the size of the robots.
  explicit PictureTracker(std::optional<FloorMap> floor = std::nullopt, FollowLimits limits = {});

  /// `picture`: 8 bits, blue, green, red or grey. Times ascend. Robots that are not confirmed are left out.
  [[nodiscard]] std::vector<TrackedRobot> process(const cv::Mat& picture, double time_s);

  /// Nothing while there is neither a calibration nor a robot.
  [[nodiscard]] const std::optional<FloorMap>& floor() const { return floor_; }
  /// Of the robots' discs, px: as found, or else as a calibration states it for the middle of the picture.
  [[nodiscard]] std::optional<double> radius_px(const cv::Size& picture) const;
  [[nodiscard]] const Follower& follower() const { return follower_; }
  [[nodiscard]] Follower& follower() { return follower_; }

 private:
  [[nodiscard]] std::vector<Detection> look(const cv::Mat& grey, double time_s);
  [[nodiscard]] std::vector<Circle> predicted_discs() const;
  [[nodiscard]] cv::Rect next_strip(const cv::Size& picture, double time_s);
  [[nodiscard]] Sighting sighting_of(const cv::Mat& picture, const cv::Mat& grey,
                                     const std::vector<Detection>& found, std::size_t index) const;

  std::optional<FloorMap> floor_;
  const bool calibrated_;
  Detector detector_;
  Follower follower_;
  int strip_ = 0;
  std::optional<double> last_s_;
};

}  // namespace kilotwin::track
