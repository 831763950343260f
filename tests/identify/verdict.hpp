/// What a scene says of what was identified in it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// Errors are of predictions against what the tracker would have seen without noise, over the rows of the contract.
struct Verdict {
  std::string scene;
  double before_mm = 0, after_mm = 0, oracle_mm = 0;
  /// The same over rows from 20 s on: without headings nobody knows where a robot seen once is going.
  double later_before_mm = 0, later_after_mm = 0, later_oracle_mm = 0;
  int rows = 0, missing_rows = 0;
  int causes = 0, named = 0;                // true effects and faults, and how many of them were named
  std::vector<std::string> unnamed;         // true effects and faults that were not
  std::vector<std::string> false_findings;  // effects and faults found where there are none
  std::vector<std::string> found;           // "name [covariates]"
  double seconds = 0;
  std::string failure;  // why there is nothing to judge; empty where there is

  /// The most the error may be above the oracle's.
  static constexpr double kRatio = 1.10;
  double ratio() const;
  bool good() const;
};

/// Judges OUT/predictions.csv and OUT/result.json alone.
Verdict judge(const Scene& scene, const std::vector<Prediction>& oracle, const std::filesystem::path& out);

/// Whether an effect with these covariates names the cause.
bool names(const Effect& effect, const Covariates& covariates);
/// Whether it has to do with it: names it or a part of it, and blames nothing that only looks alike.
bool touches(const Effect& effect, const Covariates& covariates);

}  // namespace kilotwin::truth
