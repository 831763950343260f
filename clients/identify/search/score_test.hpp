/// Score test of all hypotheses on the innovations of the fitted model. Scores U and information I of the
/// hypotheses' columns are reduced by the model's own columns (linearisation.hpp). For each hypothesis:
///   - the statistic U' I^-1 U, with a threshold for the minimal p over all hypotheses. The null distribution follows from
///     sign flips of whole clusters, which preserve the dependence within clusters and between hypotheses;
///   - the log evidence, maximised over the scale of the prior: the integral over the coefficients penalises columns;
///   - the cross-validated gain in log likelihood, on robots outside the estimate of the coefficients.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// Result of one hypothesis.
struct Finding {
  std::size_t hypothesis = 0;
  double statistic = 0, log10_p = 0;  ///< of the score test alone
  int degrees = 0;
  double evidence = 0;        ///< log marginal likelihood over the null model, minus the choice penalty
  double relative_scale = 0;  ///< scale of the prior at which the evidence is largest
  double held_out = 0;        ///< cross-validated gain in log likelihood
};

/// The distribution of the statistic without an effect.
enum class Tail : std::uint8_t {
  kOfColumns,  ///< chi-squared with one degree of freedom per column; has power for effects that only few clusters show
  /// Chi-squared with the degrees of freedom that the flips show, fewer where a few clusters hold most of the scores (Satterthwaite).
  /// Has power beside large effects that the model lacks: by the other tail, some hypothesis has tiny p under many flips then, and the
  /// threshold of all becomes very strict.
  kOfClusters
};

/// The entries of the information that a ScoreTest reads.
[[nodiscard]] ColumnGroups columns_read_by_test(const MotionModel&, const Dictionary&);

/// Score test of all columns of a dictionary, given a model.
class ScoreTest {
 public:
  /// `units`: linearised with the model's blocks first and the dictionary's after them, at least the entries of
  /// columns_read_by_test().
  ScoreTest(const Fitter&, const MotionModel&, const std::vector<Unit>& units, const Dictionary&);

  struct Outcome {
    std::vector<Finding> findings;  ///< one per hypothesis, in order
    double threshold_log10_p =
        0;  ///< under the null hypothesis the smallest log10 p falls below it with probability kFamilyAlarm
  };
  /// Tests the dictionary in addition to all terms of the model.
  [[nodiscard]] Outcome test(std::uint64_t seed, Tail) const;
  /// Evidence and cross-validated gain of a hypothesis if one term of the model is removed; below 0: none is
  /// removed.
  [[nodiscard]] Finding evidence_of(const Hypothesis&, int without_term) const;
  [[nodiscard]] std::vector<Finding> evidence_of_each(const std::vector<const Hypothesis*>&,
                                                      int without_term) const;
  /// The same for a term of the model itself.
  [[nodiscard]] Finding evidence_of_term(int term) const;

  /// Family-wise error rate: probability of any detection in a set without an effect.
  static constexpr double kFamilyAlarm = 0.003;

 private:
  struct Beside;
  struct Reduced;
  /// Information, scores per cluster and score of the dictionary's columns beside the model.
  struct ReducedDictionary {
    Eigen::MatrixXd information, clusters;
    Eigen::VectorXd score;
  };
  [[nodiscard]] ReducedDictionary reduced_dictionary() const;
  [[nodiscard]] Finding finding_of(std::size_t hypothesis, const ReducedDictionary&, const Eigen::MatrixXd& flipped,
                                   Tail, Eigen::VectorXd& flips_log10_p) const;
  [[nodiscard]] Beside beside(int without_term) const;
  [[nodiscard]] Reduced reduce(const std::vector<Eigen::Index>& columns, const Beside&, bool by_cluster) const;
  [[nodiscard]] Finding evidence_of(const Hypothesis&, const Beside&) const;
  [[nodiscard]] Finding evidence_of(const Reduced&, const Eigen::VectorXd& scale, double log_choices) const;

  const MotionModel model_;  ///< as linearised: a search goes on while its test is in use
  const Dictionary& dictionary_;
  std::uint32_t threads_;
  Eigen::Index own_;  ///< number of columns of base parameters and terms
  Eigen::MatrixXd information_;
  Eigen::VectorXd score_;
  Eigen::VectorXd prior_;  ///< diagonal of the prior precision of these columns
  Eigen::VectorXd pull_;   ///< gradient of their prior
  /// Folds of the cross-validation.
  struct Folds {
    std::vector<Eigen::MatrixXd> information;
    std::vector<Eigen::VectorXd> score;
    Folds(std::size_t count, Eigen::Index columns);
  };
  Folds by_unit_{0, 0};
  /// Folds of time intervals within each robot's tracks: for effects of single robots, which other robots cannot
  /// predict.
  Folds by_cluster_{0, 0};
  Eigen::MatrixXd clusters_;  ///< scores of all columns, one column per cluster
  std::vector<std::size_t> cluster_unit_, cluster_run_;
};

}  // namespace kilotwin::identify
