/// Classifier two-sample test between runs (Lopez-Paz, Oquab 2017): features of track windows, two classifiers,
/// and the area under the ROC curve on unseen robots; 0.5 is chance level.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/track_windows.hpp"

namespace kilotwin::kilogrid {

/// Area under the ROC curve: the share of (negative, positive) pairs in the right order; ties count one half.
[[nodiscard]] double area_under_curve(const std::vector<double>& of_negatives,
                                      const std::vector<double>& of_positives);

struct ClassifierResult {
  double logistic = 0.5, boosted = 0.5;
  double logistic_sd = 0, boosted_sd = 0;  ///< standard errors by a bootstrap over robots
  [[nodiscard]] double best() const { return logistic > boosted ? logistic : boosted; }
  [[nodiscard]] double best_sd() const { return logistic > boosted ? logistic_sd : boosted_sd; }
};
/// Two-fold cross-validation over robots.
[[nodiscard]] ClassifierResult classifier_test(const std::vector<TrackWindow>& a,
                                               const std::vector<TrackWindow>& b);

}  // namespace kilotwin::kilogrid
