/// What could be behind a residual: every pair of something that effects act on and of covariates that it may depend on, each
/// with columns of a basis that takes shapes of many kinds.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// A cause that may be added to the model.
struct Hypothesis {
  std::string name;                     ///< as the effect will be called
  std::vector<std::string> covariates;  ///< by the words of result.json
  std::string acts_on;                  ///< in words
  /// Columns of the dictionary, ascending (0 is the first column of the first block).
  std::vector<Eigen::Index> columns;
  std::uint32_t family = 0;  ///< hypotheses of one family have the same target and the same covariates
  /// Log of how many others of its family are tried beside it: where a step is, which wave it is.
  double log_choices = 0;
};

/// All that is tried, with the columns of all hypotheses once.
struct Dictionary {
  std::vector<Block> blocks;
  std::vector<Hypothesis> hypotheses;
  std::vector<std::string> families;
  /// Per column: the standard deviation that is natural to its target, less for rough shapes.
  Eigen::VectorXd scale;

  /// The blocks, cut down to the columns of a hypothesis: what is added to the model.
  [[nodiscard]] Term term_of(const Hypothesis&, double relative_scale) const;
  [[nodiscard]] Eigen::Index columns() const { return scale.size(); }
};

/// What the data can tell of: ranges of covariates, robots, what was commanded.
struct Extent {
  double x_low_mm = 0, x_high_mm = 1, y_low_mm = 0, y_high_mm = 1;
  double duration_s = 1, motor_s = 1, driven_s = 1, since_s = 1;
  double since_rest_s = 1;  ///< the longest
  double difference_s = 1;  ///< of the use of a robot's motors, the largest
  bool has_stop = false, has_turns = false, has_straight = false, neighbours = false, headings = false;
  std::vector<std::uint32_t> robots, runs;
};
[[nodiscard]] Extent extent_of(const PreparedSet&);

/// Beside what is `found` already: that some show more of it than others is tried as well.
[[nodiscard]] Dictionary dictionary_of(const Extent&, const std::vector<Term>& found = {});

}  // namespace kilotwin::identify
