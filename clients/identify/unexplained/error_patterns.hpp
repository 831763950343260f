/// Patterns of prediction errors: their means over bins of one covariate, or of two together.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "clients/identify/unexplained/prediction_windows.hpp"

namespace kilotwin::identify {

/// Means over the bins of one or two covariates.
struct Pattern {
  std::vector<Feature> over;
  bool in_body = false;  ///< components: ahead and left; else along x and y of the arena
  /// Bins: first covariate, second covariate. With one covariate the second has one bin at 0.
  std::vector<double> at, and_at;
  Eigen::MatrixXd first_mm,
      second_mm;     ///< means of the components, rows by `and_at`, columns by `at`; NaN: no data
  double share = 0;  ///< of the mean square error of other windows that these means predict
};

/// Patterns of `known` that predict at least `least_share` of the mean square error of `held_out`. A pair is listed only if
/// it predicts more than its covariates do one by one, by the same share. The largest share first; of a pair counts what it
/// adds to its better covariate.
[[nodiscard]] std::vector<Pattern> patterns_of(const std::vector<Window>& known,
                                               const std::vector<Window>& held_out, double least_share);

}  // namespace kilotwin::identify
