/// Differences between predicted tracks as innovations: what they are worth beside noise and unknown biases.
///
/// A track is z = m + e with the predicted m and a Gaussian e: tracker noise, process noise, and the biases' uncertainty. A linear
/// Kalman filter about the predicted track turns a difference d of tracks into its part of the innovations, divided by their
/// standard deviations. The rows w that result have w' w = d' cov(e)^-1 d, the Fisher information where d is a derivative
/// (Schweppe's form of the likelihood; docs/explanation/identification.md, section "Planning a recording").
#pragma once

#include <Eigen/Core>
#include <vector>

#include "clients/identify/design/tracked_plan.hpp"
#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

/// Conditions of a future recording, apart from the commands.
struct RecordingConditions {
  double every_s = 0.5;  ///< between two samples of a robot
  bool headings = true;  ///< whether the tracker measures them
  BaseParameters base;
  Noise noise;
  /// Uncertainty of a robot's biases, by number. Other robots: that of the population.
  std::map<std::uint32_t, Eigen::Matrix2d> bias_covariance;
};

/// Numbers per sample: x, y, heading.
inline constexpr Eigen::Index kSampleNumbers = 3;

/// The measured numbers of `track` less those of `from`; headings within a half turn.
[[nodiscard]] Eigen::VectorXd difference_of(const std::vector<Sample>& track, const std::vector<Sample>& from);

/// Whitened innovations, a row per number of each sample; 0 in rows that are not measured. `track`: as predicted. `usable`: by sample,
/// false in contact. The filter then starts anew at the next measured position. Columns of `differences` as from difference_of().
[[nodiscard]] Eigen::MatrixXd whitened(const RecordingConditions&, const PlannedRobot&,
                                       const std::vector<Sample>& track, const std::vector<bool>& usable,
                                       const Eigen::MatrixXd& differences);

}  // namespace kilotwin::identify
