/// How all that was measured depends on the parameters of the model, all at once: innovations of the filter regressed on
/// their derivatives by every column. A column forces the pose (or the measurement) by a known amount per unit of its
/// coefficient; the recursion of the filter carries the force into all later innovations. Score and information of a
/// parameter, of a hypothesis, of hundreds of them, come out of one pass.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

/// The columns before those of blocks.
enum BaseColumn { kStraightSpeed, kTurnSpeed, kWheelBase, kAheadPoint, kLeftPoint, kBaseColumns };

/// What belongs to one robot (or one track, where robots are few): its biases have been eliminated.
struct Unit {
  std::uint32_t robot = 0;
  Eigen::MatrixXd information;     ///< of all columns
  Eigen::VectorXd score;           ///< sum over clusters
  Eigen::MatrixXd cluster_scores;  ///< a column per cluster
  std::vector<std::uint32_t> cluster_run;
  // The biases: (change) = bias_step - bias_by_column * (change of the columns).
  Eigen::Vector2d bias_step;
  Eigen::MatrixXd bias_by_column;   ///< 2 x columns
  Eigen::Matrix2d bias_covariance;  ///< with the columns held
  double log_likelihood = 0;
  std::size_t samples = 0, outliers = 0, lost = 0;
};

struct LineariseOptions {
  double cluster_s = 100;  ///< a track is cut into clusters of about this length
  std::uint32_t threads = 2;
  /// Blocks after those of the model stand for this term of it, not beside it; below 0: beside all.
  int instead_of = -1;
};

/// The tracks of each unit are units[i]. Columns: BaseColumn, then those of the blocks in order.
[[nodiscard]] std::vector<Unit> linearise(const MotionModel&,
                                          const std::vector<std::vector<const TrackView*>>& units,
                                          const std::vector<Block>& blocks, const LineariseOptions&);

/// Runs `work(i)` for i = 0..count-1 on so many threads.
void in_parallel(std::size_t count, std::uint32_t threads, const std::function<void(std::size_t)>& work);

}  // namespace kilotwin::identify
