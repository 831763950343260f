/// Hypotheses about effects: each combines a target with the covariates that it may depend on, and selects basis
/// columns that can represent many shapes.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

/// An effect that may be added to the model.
struct Hypothesis {
  std::string name;                     ///< name of the effect
  std::vector<std::string> covariates;  ///< names of result.json
  std::string acts_on;                  ///< in words
  /// Dictionary columns, ascending (0: first column of the first block).
  std::vector<Eigen::Index> columns;
  std::uint32_t family = 0;  ///< hypotheses of one family have the same target and the same covariates
  /// Logarithm of the number of alternatives in the family (times of a step, frequencies): the prior's choice
  /// penalty.
  double log_choices = 0;
};

/// All hypotheses, and the union of their columns.
struct Dictionary {
  std::vector<Block> blocks;
  std::vector<Hypothesis> hypotheses;
  std::vector<std::string> families;
  /// Prior standard deviation of each column: the natural size of the target, smaller for rough columns.
  Eigen::VectorXd scale;

  /// The term that adds the hypothesis to the model. `relative_scale`: factor of the prior standard deviations.
  [[nodiscard]] Term term_of(const Hypothesis&, double relative_scale) const;
  [[nodiscard]] Eigen::Index columns() const { return scale.size(); }
};

/// The extent of the data: ranges of covariates, robots, commands.
struct Extent {
  double x_low_mm = 0, x_high_mm = 1, y_low_mm = 0, y_high_mm = 1;
  double duration_s = 1, motor_s = 1, driven_s = 1, since_s = 1;
  double since_rest_s = 1;  ///< longest time without a rest
  double commands = 1;      ///< largest number of commands of a robot in a run
  double sum_s = 1;         ///< largest sum of the motor-on times of a robot's two motors
  double difference_s = 1;  ///< largest difference between the motor-on times of a robot's two motors
  bool has_stop = false, has_turns = false, has_straight = false, neighbours = false, headings = false;
  std::vector<std::uint32_t> robots, runs;
};
[[nodiscard]] Extent extent_of(const PreparedSet&);

/// For terms already found, the dictionary also has hypotheses about their amplitudes.
[[nodiscard]] Dictionary dictionary_of(const Extent&, const std::vector<Term>& found = {});

/// Hypotheses without a named form: products of bases over any two covariates, and maps that change with time. One
/// dictionary per family of covariates, since the cost rises with the square of the columns.
[[nodiscard]] std::vector<Dictionary> general_dictionaries_of(const Extent&);

}  // namespace kilotwin::identify
