#include "clients/cameras/sensor_noise.hpp"

#include <cmath>

#include "core/random/random.hpp"

namespace kilotwin::cameras {
namespace {

/// Length of the table. Rows start at random places: two rows of one frame overlap, but not pixel on pixel beside each other.
constexpr std::size_t kTable = std::size_t{1} << 20;

}  // namespace

SensorNoise::SensorNoise(double read_noise, double shot_noise, std::uint64_t seed) : seed_(seed), normal_(kTable) {
  for (std::size_t level = 0; level < deviation_.size(); ++level) {
    const double shot = shot_noise * std::sqrt(static_cast<double>(level) / 255);
    deviation_[level] = static_cast<float>(std::hypot(read_noise, shot));
  }
  cv::Mat table(1, static_cast<int>(kTable), CV_32F, normal_.data());
  cv::RNG(seed).fill(table, cv::RNG::NORMAL, 0, 1);
}

void SensorNoise::add(cv::Mat& picture, std::uint64_t frame) const {
  const std::size_t width = static_cast<std::size_t>(picture.cols) * static_cast<std::size_t>(picture.channels());
  for (int row = 0; row < picture.rows; ++row) {
    const auto bits = philox4x32({static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32),
                                  static_cast<std::uint32_t>(row), 0},
                                 {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
    auto* const levels = picture.ptr<std::uint8_t>(row);
    std::size_t from = bits[0] % kTable;
    for (std::size_t i = 0; i < width; ++i) {
      // Half a level is added before truncation: a value is rounded to the nearest level.
      const float value = static_cast<float>(levels[i]) + deviation_[levels[i]] * normal_[from] + 0.5f;
      levels[i] = static_cast<std::uint8_t>(value < 0 ? 0 : value > 255 ? 255 : value);
      from = from + 1 == kTable ? 0 : from + 1;
    }
  }
}

}  // namespace kilotwin::cameras
