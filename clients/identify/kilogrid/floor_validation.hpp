/// How good a model of the floor is, on runs that it was not fitted to: cells predicted, and simulated runs that pass for
/// measured ones.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/kilogrid/cell_filter.hpp"
#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

struct Judged {
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

/// Predictions for some robots of each run, in its first part; appended to `all` if there is one.
[[nodiscard]] Judged judge(const std::vector<FloorRun>& runs, const Floor&, const FloorSettings&, double horizon_s,
                           std::vector<Predicted>* all);
/// rmse_mm with 95 % over robots, rows, log_likelihood_per_report.
[[nodiscard]] nlohmann::json summary_of(const Judged&);

/// How well a classifier tells simulated runs from measured ones on the runs held out, and measured ones of other days
/// from each other: areas under the curve with 95 % over robots, and what each feature tells by itself. `alike`: runs learned from that are like the others.
[[nodiscard]] nlohmann::json classify(const std::vector<FloorRun>& alike, const std::vector<FloorRun>& unlike,
                                      const std::vector<FloorRun>& test, const FloorTarget& held_out,
                                      const FloorSettings& before, const FloorSettings& after);

}  // namespace kilotwin::kilogrid
