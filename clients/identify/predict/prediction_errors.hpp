/// How far predictions were from what was measured: root mean squares, how sure they are, and what no model could avoid.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/forecast.hpp"

namespace kilotwin::identify {

/// Squared distances between predictions and measurements, by (run, place of the track).
struct PredictionErrors {
  struct Part {
    double sum_mm2 = 0;
    std::size_t rows = 0;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Part> by_track;
  double sum_mm2 = 0, expected_mm2 = 0;  ///< of all; expected: by the predictions themselves
  std::size_t rows = 0;

  [[nodiscard]] double rmse_mm() const;
  [[nodiscard]] double expected_mm() const;
};

[[nodiscard]] PredictionErrors errors_of(const MeasuredSet&, const std::vector<Predicted>&);

/// Bounds of 95 %, mm.
struct Interval {
  double low_mm, high_mm;
};

/// Of root mean squares before and after and of their difference, by drawing robots and runs anew, each for themselves: tracks of
/// a robot resemble each other, and so do those of a run.
struct ErrorBounds {
  Interval before, after, less_by;
  std::size_t robots, runs;
};

/// Nothing where there is one track alone. Both errors are of the same tracks.
[[nodiscard]] std::optional<ErrorBounds> bounds_of(const MeasuredSet&, const PredictionErrors& before,
                                                   const PredictionErrors& after);

/// What did not repeat when a robot was told the same once more.
struct Replicates {
  double floor_mm =
      0;  ///< root mean square of what differs among replicates: no model of these covariates foresees it
  double repeatable_mm = 0;  ///< of what all replicates share: left to be explained
  std::size_t groups = 0, windows = 0;
};

/// Predictions of a robot at the same time of several runs, under the same commands since `horizon_s` before, are
/// replicates: their errors, seen from the body at the start, are pooled within each group. `sets` with their predictions.
/// Nothing where there are too few.
[[nodiscard]] std::optional<Replicates> replicates_of(
    const std::vector<std::pair<const MeasuredSet*, const std::vector<Predicted>*>>& sets, double horizon_s);

}  // namespace kilotwin::identify
