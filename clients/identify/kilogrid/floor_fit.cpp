#include "clients/identify/kilogrid/floor_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include "clients/identify/kilogrid/floor_evidence.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Length of design runs: effects of parameters appear early.
constexpr double kExplored_s = 1500;

/// Robust weights that fall beyond three tolerances, since no parameter may reach such a statistic.
Eigen::VectorXd weights_of(const Eigen::VectorXd& off) {
  return off.unaryExpr([](double r) { return std::abs(r) < 3 ? 1.0 : 3 / std::abs(r); });
}

/// Weights of the statistics in the fit: window features count most, because the classifier test uses them. The
/// selection of effects uses equal weights.
const Eigen::VectorXd& importance() {
  static const Eigen::VectorXd all = [] {
    // Weight relative to the others; a larger one fits windows at the cost of the rest.
    constexpr double kWindows = 2.5;
    Eigen::VectorXd v = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(statistic_count()));
    for (const StatisticGroup& group : statistic_groups()) {
      if (group.name.starts_with("windows"))
        v.segment(static_cast<Eigen::Index>(group.first), static_cast<Eigen::Index>(group.size()))
            .setConstant(kWindows);
    }
    return v;
  }();
  return all;
}

/// Metric of the misfit: statistics in tolerances; window features are decorrelated over robots, so their sum of
/// squares measures how well windows can be classified.
class Metric {
 public:
  Metric(const FloorTarget& target, const FloorSet& simulated)
      : target_(target), parts_(correlation_of({&simulated, 1})) {
    // The same regularisation as in floor_evidence.cpp.
    constexpr double kOwn = 0.5;
    parts_ *= 1 - kOwn;
    for (Eigen::Index s = 0; s < parts_.rows(); ++s) {
      for (Eigen::Index t = 0; t < s; ++t) {
        const bool both = importance()(s) > 1 && importance()(t) > 1;
        if (!both) parts_(s, t) = parts_(t, s) = 0;
      }
      parts_(s, s) = 1;
    }
    roots_.compute(parts_);
  }
  /// Deviations of a model in this metric.
  [[nodiscard]] Eigen::VectorXd off(const FloorStatistics& at) const {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(parts_.rows());
    for (Eigen::Index s = 0; s < v.size(); ++s) {
      const auto q = static_cast<std::size_t>(s);
      const double by = at.value[q] - target_.statistics().value[q];
      if (known(at, q)) v(s) = by / sd(at, q);
    }
    return roots_.matrixL().solve(v);
  }
  [[nodiscard]] Eigen::MatrixXd slopes(const FloorStatistics& at, Eigen::MatrixXd of) const {
    for (Eigen::Index s = 0; s < of.rows(); ++s) {
      const auto q = static_cast<std::size_t>(s);
      of.row(s) *= known(at, q) ? 1 / sd(at, q) : 0;
    }
    return roots_.matrixL().solve(of);
  }
  /// Robust misfit: large deviations count linearly.
  [[nodiscard]] double misfit(const FloorStatistics& at) const {
    const Eigen::VectorXd off = this->off(at);
    return (importance().array() * weights_of(off).array() * off.array().square()).sum();
  }

 private:
  [[nodiscard]] bool known(const FloorStatistics& at, std::size_t s) const {
    return target_.tolerance()[s] > 0 && std::isfinite(at.value[s] - target_.statistics().value[s]) &&
           std::isfinite(at.variance[s]);
  }
  [[nodiscard]] double sd(const FloorStatistics& at, std::size_t s) const {
    return std::sqrt(target_.tolerance()[s] + at.variance[s]);
  }

  const FloorTarget& target_;
  Eigen::MatrixXd parts_;
  Eigen::LLT<Eigen::MatrixXd> roots_;
};

/// Linear surrogate of the statistics around a model: off + slopes * steps.
struct Surrogate {
  Eigen::VectorXd off;
  Eigen::MatrixXd slopes;  ///< statistics x parameters
};

/// Minimises the misfit of the surrogate within the box.
Eigen::VectorXd best_steps(const Surrogate& surrogate, const FloorBox& box) {
  const Eigen::Index columns = surrogate.slopes.cols();
  Eigen::VectorXd steps = Eigen::VectorXd::Zero(columns);
  const Eigen::VectorXd weights = weights_of(surrogate.off).cwiseProduct(importance());
  // Coordinate descent with box constraints. Parameters without influence stay.
  Eigen::VectorXd residual = surrogate.off;
  // Weight of the present parameters; a larger one makes steps shorter where statistics say little.
  constexpr double kStay = 3;
  for (int sweep = 0; sweep < 300; ++sweep) {
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto slope = surrogate.slopes.col(p);
      const double curve = (weights.array() * slope.array().square()).sum() + kStay;
      const double gradient = (weights.array() * slope.array() * residual.array()).sum() + kStay * steps(p);
      const auto q = static_cast<std::size_t>(p);
      const double to = std::clamp(steps(p) - gradient / curve, box.least[q], box.most[q]);
      residual += (to - steps(p)) * slope;
      steps(p) = to;
    }
  }
  return steps;
}

/// Number of simulations per measured run that determine a model's misfit.
constexpr int kEngineRuns = 1, kQuickRuns = 2;

/// Differences of two sets of statistics, with the expected noise removed.
std::vector<double> differences(const FloorStatistics& one, const FloorStatistics& other) {
  std::vector<double> more(one.value.size(), 0);
  for (std::size_t s = 0; s < more.size(); ++s) {
    const double difference = one.value[s] - other.value[s], chance = one.variance[s] + other.variance[s];
    if (std::isfinite(difference) && difference != 0)
      more[s] = difference * std::max(0.0, 1 - chance / (difference * difference));
  }
  return more;
}

/// Simulated statistics of a model, with common random numbers.
using Said = std::function<FloorStatistics(const FloorModel&)>;

/// Trust-region iterations on the surrogate.
class TrustRegion {
 public:
  TrustRegion(const FloorTarget& target, const Metric& metric, double width, double longest_s, std::uint64_t seed,
              const FloorProgress& progress)
      : target_(target), metric_(metric), width_(width), longest_s_(longest_s), seed_(seed), progress_(progress) {}

  /// One iteration. Keeps the model if it is not improved. Returns the misfit.
  double step(FloorModel& model, const Said& said_by) {
    const std::size_t parameters = model.values.size(), runs = target_.scenes().size();
    const std::vector<bool> all(parameters, true);
    const FloorStatistics at = said_by(model);
    const double misfit = metric_.misfit(at);
    // Four simulations per parameter at first: fewer make the slopes too noisy. Later rounds reuse earlier
    // simulations, so two suffice.
    add_points(points_, model, target_, all, (rounds_ == 0 ? 4 : 2) * parameters + 12, width_, longest_s_,
               seed_ * 10 + rounds_);
    ++rounds_;
    const Surrogate surrogate{metric_.off(at), metric_.slopes(at, slopes_of(points_, model, all, runs, width_))};
    const FloorModel before = model;
    // A step that raises the misfit left the trust region: shrinks it.
    constexpr double kShorter = 0.4;
    constexpr int kTries = 2;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const Eigen::VectorXd steps = best_steps(surrogate, box_around(before, width_, most_));
      model.values = moved(before, {steps.data(), steps.data() + steps.size()}, width_);
      const double now = metric_.misfit(said_by(model));
      progress_(fmt::format("misfit {:.0f} -> {:.0f} of {} statistics", misfit, now, target_.size()));
      if (now < misfit) return now;
      model = before;
      most_ *= kShorter;
    }
    return misfit;
  }

 private:
  const FloorTarget& target_;
  const Metric& metric_;
  double width_, longest_s_;
  std::uint64_t seed_, rounds_ = 0;
  const FloorProgress& progress_;
  FloorPoints points_;
  double most_ = 1.5;  ///< trust region radius, in parameter scales
};

/// Simulated runs of the model as a set, for the correlations.
FloorSet quick_set(const FloorTarget& target, const FloorModel& model, std::uint64_t seed) {
  return FloorSet(simulated_sums(target, model.settings(), seed * 7 + 3, kQuickRuns, Simulator::kQuick));
}

/// Coarse-to-fine fit with fast runs of the first `longest_s` of each measured run. Returns the misfit.
double fit_coarsely(FloorModel& model, const FloorTarget& begun, double width, int rounds, double longest_s,
                    std::uint64_t seed, const FloorProgress& progress) {
  const auto said_by = [&](const FloorModel& of) {
    return simulated_statistics(begun, of.settings(), seed * 7 + 2, kQuickRuns, Simulator::kQuick);
  };
  const Metric metric(begun, quick_set(begun, model, seed));
  TrustRegion approach(begun, metric, width, longest_s, seed, progress);
  double misfit = 0;
  for (int round = 0; round < rounds; ++round) misfit = approach.step(model, said_by);
  return misfit;
}

}  // namespace

double fit(FloorModel& model, const FloorTarget& target, int rounds, double width, std::uint64_t seed,
           const FloorProgress& progress) {
  model.later = target.later();
  const auto quick = [&](const FloorModel& of) {
    return simulated_statistics(target, of.settings(), seed * 7 + 2, kQuickRuns, Simulator::kQuick);
  };
  FloorModel best = model;
  double least = std::numeric_limits<double>::infinity(), misfit = 0;
  const Metric metric(target, quick_set(target, model, seed));
  TrustRegion approach(target, metric, width, kExplored_s, seed, progress);
  for (int round = 0;; ++round) {
    // Fast runs give the steps, corrected by their difference from the engine at this model. The engine ranks the
    // results.
    const FloorStatistics engine = simulated_statistics(target, model.settings(), seed * 7 + 1, kEngineRuns);
    const double here = metric.misfit(engine);
    progress(fmt::format("misfit {:.0f} in the engine", here));
    if (here < least) {
      least = here;
      best = model;
      misfit = target.misfit(engine);
    }
    if (round == rounds) break;
    const std::vector<double> more = differences(engine, quick(model));
    approach.step(model, [&](const FloorModel& of) {
      FloorStatistics at = quick(of);
      for (std::size_t s = 0; s < more.size(); ++s) at.value[s] += more[s];
      return at;
    });
  }
  model = best;
  return misfit;
}

namespace {

/// Changes of the statistics without each robot of the measured runs: a column per robot.
Eigen::MatrixXd without_each_robot(const FloorSet& set) {
  std::vector<RobotSums> robots;
  for (const std::vector<RobotSums>& run : set.runs) robots.insert(robots.end(), run.begin(), run.end());
  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(statistic_count()), static_cast<Eigen::Index>(robots.size()));
  for (std::size_t r = 0; r < robots.size(); ++r) {
    std::swap(robots[r], robots.back());
    const FloorStatistics less = statistics_of(std::span(robots).first(robots.size() - 1));
    std::swap(robots[r], robots.back());
    for (Eigen::Index q = 0; q < out.rows(); ++q) {
      const double change =
          less.value[static_cast<std::size_t>(q)] - set.statistics.value[static_cast<std::size_t>(q)];
      if (std::isfinite(change)) out(q, static_cast<Eigen::Index>(r)) = change;
    }
  }
  return out;
}

/// Variances of linear estimates by the jackknife: a column of changes per robot that is left out.
Eigen::VectorXd jackknife(const Eigen::MatrixXd& changes) {
  const auto robots = static_cast<double>(changes.cols());
  const Eigen::MatrixXd off = changes.colwise() - changes.rowwise().mean();
  return (robots - 1) / robots * off.rowwise().squaredNorm();
}

}  // namespace

std::vector<double> standard_errors(const FloorModel& model, const FloorTarget& target, std::uint64_t seed) {
  constexpr double kWidth = 0.5;  // of the last rounds of the fit
  const Metric metric(target, quick_set(target, model, seed));
  const FloorStatistics at =
      simulated_statistics(target, model.settings(), seed * 7 + 2, kQuickRuns, Simulator::kQuick);
  const std::vector<bool> all(model.values.size(), true);
  const Eigen::MatrixXd slopes =
      metric.slopes(at, slopes_around(model, target, all, kWidth, kExplored_s, seed * 10));
  // Robust weights, as in the fit: statistics that no parameter reaches count less.
  const Eigen::VectorXd weights = weights_of(metric.off(at)).cwiseProduct(importance());
  const Eigen::MatrixXd weighted = weights.asDiagonal() * slopes;
  // Directions of parameters that the statistics do not see have no finite error.
  constexpr double kSeen = 1e-6;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> bread(slopes.transpose() * weighted);
  const double least = kSeen * std::max(bread.eigenvalues().maxCoeff(), 1e-300);
  const Eigen::VectorXd inverse =
      bread.eigenvalues().unaryExpr([&](double v) { return v > least ? 1 / v : 1 / least; });
  const Eigen::MatrixXd half =
      bread.eigenvectors() * inverse.asDiagonal() * bread.eigenvectors().transpose() * weighted.transpose();
  // Statistics of the same robots depend on each other. So robots are left out in turn; the fit's own simulations are such robots, too.
  const Eigen::VectorXd of_robots =
      (1 + 1.0 / kQuickRuns) * jackknife(half * metric.slopes(at, without_each_robot(target.set())));
  const std::vector<FloorParameter> parameters = model.parameters();
  std::vector<double> out;
  out.reserve(parameters.size());
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const auto row = static_cast<Eigen::Index>(p);
    const double variance = std::max(half.row(row).squaredNorm(), of_robots(row)),
                 sd = std::sqrt(variance) * kWidth * parameters[p].width;
    const bool seen = slopes.col(static_cast<Eigen::Index>(p)).squaredNorm() > 0;
    out.push_back(seen && std::isfinite(sd) ? sd : std::numeric_limits<double>::infinity());
  }
  return out;
}

void fit_from_far_start(FloorModel& model, const FloorTarget& target, std::uint64_t seed,
                        const FloorProgress& progress) {
  // The misfit has several local minima. Slopes over wide steps lead to deep ones; short runs suffice for them.
  struct Stage {
    double width, longest_s;
    int rounds;
  };
  const bool fitted_before = model.terms.size() > 1;
  const std::vector<Stage> stages =
      fitted_before ? std::vector<Stage>{{2, 800, 2}} : std::vector<Stage>{{4, 500, 3}, {2, 800, 2}};
  std::vector<FloorModel> starts{model};
  // Also restarts from the initial values of the base, because effects move the minima.
  starts.push_back(model);
  for (std::size_t p = 0; p < model.terms[0].parameters.size(); ++p)
    starts.back().values[p] = model.terms[0].parameters[p].start;
  if (starts[1].values == starts[0].values) starts.pop_back();
  double least = std::numeric_limits<double>::infinity();
  std::vector<FloorTarget> begun;
  for (const Stage& stage : stages) begun.push_back(target.cut(stage.longest_s));
  for (FloorModel& start : starts) {
    start.later = target.later();
    double misfit = 0;
    for (std::size_t i = 0; i < begun.size(); ++i)
      misfit = fit_coarsely(start, begun[i], stages[i].width, stages[i].rounds, stages[i].longest_s, seed * 3 + i,
                            progress);
    if (misfit >= least) continue;
    least = misfit;
    model = start;
  }
}

}  // namespace kilotwin::kilogrid
