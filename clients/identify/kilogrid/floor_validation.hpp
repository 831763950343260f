/// Validation on held-out runs: cell predictions, and the classifier two-sample test.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/kilogrid/cell_filter.hpp"
#include "clients/identify/kilogrid/floor_target.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::kilogrid {

struct Validation {
  double sum = 0, log_likelihood = 0;
  std::size_t rows = 0, reports = 0;
  std::vector<std::pair<double, double>> by_robot;  ///< squared errors, rows

  [[nodiscard]] double rmse_mm() const { return rows > 0 ? std::sqrt(sum / static_cast<double>(rows)) : 0; }
};

struct Predicted {
  std::string run;
  std::uint32_t robot;
  CellPrediction at;
};

/// Predictions for some robots of each run, in its first part; appended to `all` if given. The result is the same for any number of
/// threads.
[[nodiscard]] Validation validate(const std::vector<FloorRun>& runs, const Floor&, const FloorSettings&,
                                  double horizon_s, std::uint32_t threads, std::vector<Predicted>* all);

/// By how much the mean squared error of one model exceeds that of another, mm^2, and its standard error over robots.
struct Excess {
  double mean_mm2 = 0, se_mm2 = 0;
};
/// `a` less `b`, of the same robots and times; infinite if the robots differ. The standard error of one robot is 0.
[[nodiscard]] Excess excess_of(const Validation& a, const Validation& b);
/// rmse_mm with its 95 % interval over robots, rows, log_likelihood_per_report.
[[nodiscard]] identification::Accuracy accuracy_of(const Validation&);

/// Areas under the ROC curve, with 95 % intervals over robots: simulated against measured held-out runs, and
/// measured runs of different days against each other; also for each single feature. `alike`: training runs that
/// resemble the others.
[[nodiscard]] identification::Classifier classify(const std::vector<FloorRun>& alike,
                                                  const std::vector<FloorRun>& unlike,
                                                  const std::vector<FloorRun>& test, const FloorTarget& held_out,
                                                  const FloorSettings& before, const FloorSettings& after);

}  // namespace kilotwin::kilogrid
