/// Measured reception counts of robots on a grid that all transmit (ARGoS paper, Fig. 2). One row per receiver,
/// counts from sender 0 on; the diagonal is the number of successful transmissions.
#pragma once

#include <Eigen/Dense>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::radio_fit {

/// One run. Entry (i, j): receiver i, sender j; below 0 if the row is missing.
struct GridRun {
  std::string name;
  Eigen::MatrixXd counts;

  [[nodiscard]] double sent(Eigen::Index robot) const { return counts(robot, robot); }
  /// Share of j's messages that i received, at most 1; below 0 if unknown.
  [[nodiscard]] double share(Eigen::Index i, Eigen::Index j) const;
};

/// Runs of one placement.
struct GridSet {
  std::string name;  ///< for example "tau000"
  double tau_s = 0;  ///< pause after a successful transmission
  double pitch_mm = 0;
  std::vector<GridRun> runs;

  [[nodiscard]] int robots() const { return static_cast<int>(runs.front().counts.rows()); }
  [[nodiscard]] int side() const;
  /// Position of a robot. Rows run downwards, like the ids.
  [[nodiscard]] Eigen::Vector2d place_mm(int robot) const;
  [[nodiscard]] double distance_mm(int a, int b) const { return (place_mm(a) - place_mm(b)).norm(); }
};

/// Number of messages sent per robot, mean over the runs.
[[nodiscard]] Eigen::VectorXd mean_sent(const GridSet& set);

/// Reads comm_tauT_runN.dat of a directory, by ascending tau. Throws UserError "FILE:LINE: what is wrong".
[[nodiscard]] std::vector<GridSet> read_grids(const std::filesystem::path& directory);

/// The runs at even, or odd, positions of each set.
[[nodiscard]] std::vector<GridSet> half_of(const std::vector<GridSet>& sets, bool odd);

}  // namespace kilotwin::radio_fit
