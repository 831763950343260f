/// Can runs be told apart? Windows of robots' tracks as features, two classifiers, and how well they do on robots that they
/// have not seen: the area under the curve, 0.5 where they guess.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_statistics.hpp"

namespace kilotwin::kilogrid {

/// Features of one robot within one window of time.
struct TrackWindow {
  std::size_t robot;  ///< index in the run
  std::vector<double> feature;
};
[[nodiscard]] const std::vector<std::string>& feature_names();
/// Windows of 200 s, one after the other, in which the robot was heard in at least half of the blocks.
[[nodiscard]] std::vector<TrackWindow> windows_of(const FloorRun&, const Floor&);

/// The area under the curve of a score: the share of pairs of one of each class that it orders rightly, ties half.
[[nodiscard]] double area_under_curve(const std::vector<double>& of_negatives,
                                      const std::vector<double>& of_positives);

struct TellApart {
  double logistic = 0.5, boosted = 0.5;
  [[nodiscard]] double best() const { return logistic > boosted ? logistic : boosted; }
};
/// Cross-validated over robots: in turn each half of the robots of both runs is learned from, the other half judged.
[[nodiscard]] TellApart tell_apart(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b);

}  // namespace kilotwin::kilogrid
