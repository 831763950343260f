/// Shared parts of the rivals of `kilotwin identify`: rates of motion from tracks with headings, and predictions by rates.
/// Body frame: x ahead, y to the left. Rates: mm/s, mm/s, rad/s.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// A robot at an instant, as far as tracks and commands show it.
struct Instant {
  double time_s = 0;
  Vec point;
  double heading_rad = 0;
  Motion motion = Motion::kStop, before = Motion::kStop;
  double since_change_s = 0;
  double driven_s = 0;  ///< time for which either motor was on
  int robot = 0;
  int near = 0;       ///< tracked robots within 70 mm
  double span_s = 0;  ///< time that it stands for; commands do not change within
};

/// The rates from one sample to the next of a track, and the instants between them.
struct RateRow {
  int track = 0;
  std::vector<Instant> instants;
  Eigen::Vector3d rates;
};

/// All pairs of samples that are less than 1.5 s apart, of all tracks of some runs, except at walls and at other robots.
[[nodiscard]] std::vector<RateRow> rate_rows(const std::vector<Run>& runs);

/// A fitted rival. Its rates are those of a base model, with speeds and turn rates of each robot under each command, plus what it has
/// learned.
struct Rival {
  std::function<Eigen::Vector3d(const Instant&)> rates;
  Eigen::VectorXd straight_mm_s;  ///< by robot: the base model's part of the speed straight on
  /// Covariates that it names, as in result.json; empty for rivals that name none.
  Covariates covariates;
  bool names = false;
};

/// Fit a rival to training runs. Scenes without headings have no rates.
[[nodiscard]] Rival base_alone(const std::vector<RateRow>&, int robots);
[[nodiscard]] Rival sparse_regression(const std::vector<RateRow>&, int robots);
[[nodiscard]] Rival gaussian_process(const std::vector<RateRow>&, int robots);
[[nodiscard]] Rival neural_network(const std::vector<RateRow>&, int robots);

/// The rows of predict() (oracle.hpp): where a rival ends less where `base` ends, by rates from the same start pose. Added to the
/// predictions of a base model with a filter and contacts, it is what the rival has learned. Start poses: a weighted mean of the last
/// samples, each taken forward by `base`. Robots stay within the walls that `train` shows. `predicted`: the difference, mm.
[[nodiscard]] std::vector<Prediction> corrections(const Rival&, const Rival& base, const std::vector<Run>& train,
                                                  const Run& run, double horizon_s);

}  // namespace kilotwin::truth
