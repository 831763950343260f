/// Evaluation of one scene's results.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// Errors relative to the noise-free measurement, over the rows of the contract.
struct Verdict {
  std::string scene;
  double before_mm = 0, after_mm = 0, oracle_mm = 0;
  /// The same from 20 s on: without headings, the direction after a single sample is unknown.
  double later_before_mm = 0, later_after_mm = 0, later_oracle_mm = 0;
  /// Of the same rows the median errors. A few predictions made before a heading was known may decide about the means.
  double median_after_mm = 0, median_oracle_mm = 0;
  int rows = 0, missing_rows = 0;
  int causes = 0, named = 0;                // true effects and faults, and the number of those named
  std::vector<std::string> unnamed;         // true effects and faults not named
  std::vector<std::string> false_findings;  // effects and faults that do not exist
  std::vector<std::string> found;           // "name [covariates]"
  double seconds = 0, cpu_s = 0;
  std::string unexplained;  // the sentence that says that a systematic error is left; empty: none is
  bool perhaps = false;     // whether the result says that one may be left
  std::string failure;      // reason for a failure; empty if none

  /// Largest ratio of the error to the oracle's.
  static constexpr double kRatio = 1.10;
  double ratio() const;
  bool good() const;
};

/// Uses OUT/predictions.csv and OUT/result.json only.
Verdict judge(const Scene& scene, const std::vector<Prediction>& oracle, const std::filesystem::path& out);

/// The base model's predictions in OUT/predictions.csv, by run, robot and time in ms.
[[nodiscard]] std::map<std::tuple<std::string, int, long>, Vec> base_predictions(const std::filesystem::path& out);

/// Whether an effect with these covariates names the true effect.
bool names(const Effect& effect, const Covariates& covariates);
/// Whether it names the true effect or a part of it, and no look-alike.
bool touches(const Effect& effect, const Covariates& covariates);

}  // namespace kilotwin::truth
