/// `kilotwin identify` beside its rivals on the same sets.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"
#include "tests/identify/verdict.hpp"

namespace kilotwin::truth {

/// Errors of several methods on the sets of scenes, and which causes they name.
class Comparison {
 public:
  Comparison();
  /// Fits the rivals to a set and adds a row. `identified`: the verdict on identify's own result, in `out`. Rivals correct the
  /// predictions of its base model. Scenes without headings give no rates, so rivals cannot fit them.
  void add(const Scene&, const Play&, const std::vector<Prediction>& oracle, const Verdict& identified,
           const std::filesystem::path& out);
  void print_header() const;
  /// Over all rows: error over the oracle's and reduction of the base model's error (geometric means), mean seconds. Of the causes
  /// precision, recall, F1, and the sets with a false one. In sets without an effect: error of the robots' speeds.
  void print_summary() const;

 private:
  struct Total {
    std::string method;
    double log_ratio = 0, log_improvement = 0, seconds = 0;
    int sets = 0, causes = 0, named = 0, wrong = 0, alarms = 0;
    bool names = false;
    double speed_error = 0;  ///< relative, of the robots' speeds straight on: sum over sets without an effect
    int speed_sets = 0;
  };
  void count(Total&, const Verdict&);
  std::vector<Total> totals_;
};

}  // namespace kilotwin::truth
