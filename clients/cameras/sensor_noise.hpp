/// Noise of a camera's sensor: read noise and shot noise, a function of (seed, frame) and of the picture.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace kilotwin::cameras {

class SensorNoise {
 public:
  /// `read_noise`: standard deviation in the dark; `shot_noise`: at level 255, with a variance proportional to the level. In
  /// grey levels, at least 0.
  SensorNoise(double read_noise, double shot_noise, std::uint64_t seed);
  void add(cv::Mat& picture, std::uint64_t frame) const;

 private:
  std::uint64_t seed_;
  std::array<float, 256> deviation_{};  // by level
  std::vector<float> normal_;           // standard normal, read from a random place on for each row
};

}  // namespace kilotwin::cameras
