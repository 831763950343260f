/// Measured grids of robots that all send: how often each heard each other. The files are those of the seed's experiment
/// (its figure 2): one row per receiver, counts from sender 0 on, the diagonal being what it sent with success.
#pragma once

#include <Eigen/Dense>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::radio_fit {

/// One run. Entry (i, j) of a matrix is of receiver i and sender j; below 0 where the row is missing.
struct GridRun {
  std::string name;
  Eigen::MatrixXd counts;

  [[nodiscard]] double sent(Eigen::Index robot) const { return counts(robot, robot); }
  /// Share of j's messages that i received, at most 1; below 0 where it is not known.
  [[nodiscard]] double share(Eigen::Index i, Eigen::Index j) const;
};

/// Runs of one arrangement.
struct GridSet {
  std::string name;  ///< "tau000"
  double tau_s = 0;  ///< pause after a success
  double pitch_mm = 0;
  std::vector<GridRun> runs;

  [[nodiscard]] int robots() const { return static_cast<int>(runs.front().counts.rows()); }
  [[nodiscard]] int side() const;
  /// Place of a robot; rows go down, as the ids do.
  [[nodiscard]] Eigen::Vector2d place_mm(int robot) const;
  [[nodiscard]] double distance_mm(int a, int b) const { return (place_mm(a) - place_mm(b)).norm(); }
};

/// What each robot sent, mean over the runs.
[[nodiscard]] Eigen::VectorXd mean_sent(const GridSet& set);

/// Reads comm_tauT_runN.dat of a directory, the sets by ascending tau. Throws UserError: "FILE:LINE: what is wrong".
[[nodiscard]] std::vector<GridSet> read_grids(const std::filesystem::path& directory);

/// Of each set the runs with even, or odd, numbers in the order of their names.
[[nodiscard]] std::vector<GridSet> half_of(const std::vector<GridSet>& sets, bool odd);

}  // namespace kilotwin::radio_fit
