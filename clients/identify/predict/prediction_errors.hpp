/// Prediction errors: root mean squares, confidence intervals, and a noise floor by replicates.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/forecast.hpp"

namespace kilotwin::identify {

/// Squared distances between predictions and measurements, by (run, index of the track).
struct PredictionErrors {
  struct Part {
    double sum_mm2 = 0;
    std::size_t rows = 0;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Part> by_track;
  double sum_mm2 = 0, expected_mm2 = 0;  ///< of all tracks; expected: by the filter itself
  std::size_t rows = 0;

  [[nodiscard]] double rmse_mm() const;
  [[nodiscard]] double expected_mm() const;
};

[[nodiscard]] PredictionErrors errors_of(const MeasuredSet&, const std::vector<Forecast>&);

/// 95 % confidence interval, mm.
struct Interval {
  double low_mm, high_mm;
};

/// Intervals of the errors before and after and of their difference, by a two-way bootstrap over robots and runs
/// (Owen, The pigeonhole bootstrap, 2007): tracks of one robot are dependent, and so are those of one run.
struct ErrorBounds {
  Interval before, after, less_by;
  std::size_t robots, runs;
};

/// Nothing if there is only one track. Both errors must cover the same tracks.
[[nodiscard]] std::optional<ErrorBounds> bounds_of(const MeasuredSet&, const PredictionErrors& before,
                                                   const PredictionErrors& after);

/// Sums over the predictions of all robots of a run in a stretch of time.
struct Stretch {
  double before_mm2 = 0, after_mm2 = 0, rows = 0;
};

/// 95 % intervals for the same robots at other times.
struct StretchBounds {
  Interval before, less_by;
};

/// A bootstrap over stretches, which must be long enough to be independent. The intervals are as much wider as Student's are
/// for so many values. Nothing of fewer than 6.
[[nodiscard]] std::optional<StretchBounds> bounds_of(const std::vector<Stretch>&);

/// The part of the error that differs between repetitions of the same commands.
struct Replicates {
  double floor_mm = 0;       ///< root mean square within groups: a bound for models of these covariates
  double repeatable_mm = 0;  ///< of the group means: systematic, left to be explained
  std::size_t groups = 0, windows = 0;
};

/// Replicates are predictions of one robot at the same time of several runs, under the same commands since one
/// horizon before. Their errors are compared in the body frame at the start. `sets`: each with its forecasts.
/// Nothing if there are too few.
[[nodiscard]] std::optional<Replicates> replicates_of(
    const std::vector<std::pair<const MeasuredSet*, const std::vector<Forecast>*>>& sets, double horizon_s);

}  // namespace kilotwin::identify
