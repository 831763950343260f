/// Innovations with the part of their covariance that the process noise of driven wheels makes: data on how large this noise is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "clients/identify/fit/fit_state.hpp"

namespace kilotwin::identify {

/// One innovation of a robot that was driven since the sample before, away from walls and other robots.
struct NoiseSample {
  std::uint32_t robot = 0;
  std::size_t track = 0;  ///< index in PreparedSet::views()
  bool held_out = false;
  double time_s = 0, x_mm = 0, y_mm = 0;
  Situation at;  ///< in the last sub-step before; its neighbours point into the tracks
  int size = 0;  ///< 2, or 3 with the heading
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();  ///< the innovation
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of it, by the model
  Eigen::Matrix3d process =
      Eigen::Matrix3d::Zero();  ///< the part of it by the process noise since the sample before

  /// Log likelihood where the process noise since the sample before is `scale` times that of the model.
  [[nodiscard]] double log_likelihood(double scale) const;
  /// Derivative of log_likelihood() by the logarithm of the scale, and its expected negative second derivative.
  struct Score {
    double slope, information;
  };
  [[nodiscard]] Score score(double scale) const;
  /// Mean square of the whitened innovation: 1 on average, if the model holds.
  [[nodiscard]] double whitened_square() const;
};

/// Of all tracks, in their order.
[[nodiscard]] std::vector<NoiseSample> noise_samples_of(const FitState&, std::uint32_t threads);

/// Stretch of a track whose samples may depend on each other: number of such a stretch of kNoiseStretch_s.
inline constexpr double kNoiseStretch_s = 20;

/// The mean whitened square of a robot, and its 95 % interval by the dispersion between stretches.
struct NoiseRatio {
  double value, low, high;
};
/// Of the tracks of the fit, by robot. Robots with fewer than three stretches have none.
[[nodiscard]] std::map<std::uint32_t, NoiseRatio> noise_ratios_of(const std::vector<NoiseSample>&);

}  // namespace kilotwin::identify
