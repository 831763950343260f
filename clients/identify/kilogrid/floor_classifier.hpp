/// Can runs be told apart? Windows of robots' tracks as features, two classifiers, and how well they do on robots that they
/// have not seen: the area under the curve, 0.5 where they guess.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/track_windows.hpp"

namespace kilotwin::kilogrid {

/// The area under the curve of a score: the share of pairs of one of each class that it orders rightly, ties half.
[[nodiscard]] double area_under_curve(const std::vector<double>& of_negatives,
                                      const std::vector<double>& of_positives);

struct TellApart {
  double logistic = 0.5, boosted = 0.5;
  double logistic_sd = 0, boosted_sd = 0;  ///< standard errors over robots, by resampling them
  [[nodiscard]] double best() const { return logistic > boosted ? logistic : boosted; }
  [[nodiscard]] double best_sd() const { return logistic > boosted ? logistic_sd : boosted_sd; }
};
/// Cross-validated over robots: in turn each half of the robots of both runs is learned from, the other half judged.
[[nodiscard]] TellApart tell_apart(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b);

}  // namespace kilotwin::kilogrid
