/// Which hypothesis explains what a model leaves. All are judged at once, on the score and information of their columns
/// beyond what the model's own columns can explain (linearise.hpp):
///   - a score test each; how surprising the most surprising of them is under no effect is found by flipping the signs of
///     whole stretches of tracks at random, which leaves the dependence of samples within them and among hypotheses as it is;
///   - the log marginal likelihood of each, with the size of the effect that fits best: many columns have to earn their place;
///   - the gain in log likelihood on robots that the coefficients were not fitted to.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/search/hypotheses.hpp"
#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// How one hypothesis did.
struct Finding {
  std::size_t hypothesis = 0;
  double statistic = 0, log10_p = 0;  ///< of the score test alone
  int degrees = 0;
  double evidence = 0;        ///< log marginal likelihood over that of no effect, less the price of choosing it
  double relative_scale = 0;  ///< of its coefficients, at which that is largest
  double held_out = 0;        ///< gain in log likelihood on robots left out
};

/// Scores of all columns of a dictionary beside a model.
class Scores {
 public:
  /// `units` were linearised with the model's own blocks first and those of the dictionary after them.
  Scores(const Fitter&, const MotionModel&, const std::vector<Unit>& units, const Dictionary&);

  struct Outcome {
    std::vector<Finding> findings;  ///< of all hypotheses, in their order
    double threshold_log10_p =
        0;  ///< the most surprising of all falls below it with kFamilyAlarm where there is no effect
  };
  /// As seen beside all of the model.
  [[nodiscard]] Outcome test(std::uint64_t seed) const;
  /// Evidence and held-out gain of a hypothesis with one of the model's terms taken out; `term` < 0: with none taken out.
  [[nodiscard]] Finding weigh(const Hypothesis&, int without_term) const;
  /// The same of the term itself.
  [[nodiscard]] Finding weigh_term(int term) const;

  /// The chance of finding anything at all in a set without an effect.
  static constexpr double kFamilyAlarm = 0.003;

 private:
  struct Beside;  // information and scores of columns beside all others
  struct Reduced;
  [[nodiscard]] Reduced reduce(const std::vector<Eigen::Index>& columns, int without_term, bool by_stretch) const;
  [[nodiscard]] Finding weigh(const Reduced&, const Eigen::VectorXd& scale, double log_choices) const;

  const MotionModel& model_;
  const Dictionary& dictionary_;
  Eigen::Index own_;  ///< columns of base and terms
  Eigen::MatrixXd information_;
  Eigen::VectorXd score_;
  Eigen::VectorXd prior_;  ///< diagonal of the model's own prior information, on own columns
  /// Parts of the data that are left out in turn.
  struct Folds {
    std::vector<Eigen::MatrixXd> information;
    std::vector<Eigen::VectorXd> score;
    Folds(std::size_t count, Eigen::Index columns);
  };
  Folds by_unit_{0, 0};
  /// Stretches of every robot's tracks: for what is each robot's own, of which robots left out tell nothing.
  Folds by_stretch_{0, 0};
  Eigen::MatrixXd clusters_;  ///< scores of all columns, a column per cluster
  std::vector<std::size_t> cluster_unit_, cluster_run_;
};

}  // namespace kilotwin::identify
