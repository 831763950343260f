/// Linearisation of all measurements in all parameters of the model. Each column is a known perturbation of the
/// pose or of the measurement per unit of its coefficient; the Kalman recursion propagates it into all later
/// innovations e_k with covariance S_k. One pass gives the score g = sum J_k' S_k^-1 e_k and the information I =
/// sum J_k' S_k^-1 J_k of all parameters and of hundreds of hypotheses.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

/// Columns of the base parameters. Those of the blocks follow.
enum BaseColumn { kStraightSpeed, kTurnSpeed, kWheelBase, kAheadPoint, kLeftPoint, kBaseColumns };

/// Linearisation of one robot, or of one track if robots are few. Its biases are eliminated.
struct Unit {
  std::uint32_t robot = 0;
  Eigen::MatrixXd information;     ///< columns x columns; only entries of ColumnGroups are defined
  Eigen::VectorXd score;           ///< sum over clusters
  Eigen::MatrixXd cluster_scores;  ///< one column per cluster
  std::vector<std::uint32_t> cluster_run;
  // Change of the biases: bias_step - bias_by_column * (change of the columns).
  Eigen::Vector2d bias_step;
  Eigen::MatrixXd bias_by_column;               ///< 2 x columns
  Eigen::Matrix2d bias_covariance;              ///< with the columns fixed
  std::vector<double> log_likelihood_of_track;  ///< of likelihood_of(), in the order of the unit's tracks
  std::size_t samples = 0, outliers = 0, lost = 0;
};

/// The entries of the information that are needed: those within each group of columns, and those of the first
/// `with_all` columns with all.
struct ColumnGroups {
  Eigen::Index with_all = 0;
  std::vector<std::vector<Eigen::Index>> groups;
};

struct LineariseOptions {
  double cluster_s = 100;  ///< approximate length of a cluster, a part of a track
  std::uint32_t threads = 2;
  /// Index of a term that the blocks after the model's replace; below 0: they are added to all terms.
  int instead_of = -1;
  const ColumnGroups* needed = nullptr;  ///< null: all entries of the information
  /// Of each block after the model's: index of the model's block whose value it changes. Null: they are effects of their own.
  const std::vector<std::size_t>* of_block = nullptr;
};

/// units[i] are the tracks of unit i. Columns: BaseColumn, then the blocks in order.
[[nodiscard]] std::vector<Unit> linearise(const MotionModel&,
                                          const std::vector<std::vector<const TrackView*>>& units,
                                          const std::vector<Block>& blocks, const LineariseOptions&);

}  // namespace kilotwin::identify
