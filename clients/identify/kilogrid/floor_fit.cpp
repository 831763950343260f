#include "clients/identify/kilogrid/floor_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/floor_slopes.hpp"
#include "clients/identify/kilogrid/quick_swarm.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Runs of the design are cut to that: what parameters change shows soon.
constexpr double kExplored_s = 1500;

/// Statistics as a linear function of the parameters around a model, in tolerances: residual = off + slopes * steps.
struct Surrogate {
  Eigen::VectorXd off;     ///< simulated less measured
  Eigen::MatrixXd slopes;  ///< per statistic and parameter
};

Surrogate surrogate_of(const FloorTarget& target, const FloorStatistics& here, Eigen::MatrixXd slopes) {
  Surrogate surrogate{Eigen::VectorXd::Zero(slopes.rows()), std::move(slopes)};
  for (Eigen::Index s = 0; s < surrogate.off.size(); ++s) {
    const auto q = static_cast<std::size_t>(s);
    const double off = here.value[q] - target.statistics().value[q];
    const bool known = target.tolerance()[q] > 0 && std::isfinite(off);
    const double sd = known ? std::sqrt(target.tolerance()[q] + here.variance[q]) : 1;
    surrogate.off(s) = known ? off / sd : 0;
    surrogate.slopes.row(s) *= known ? 1 / sd : 0;
  }
  return surrogate;
}

/// Single statistics that no parameter can reach must not pull at all of them: weights fall beyond three tolerances.
Eigen::VectorXd weights_of(const Eigen::VectorXd& off) {
  return off.unaryExpr([](double r) { return std::abs(r) < 3 ? 1.0 : 3 / std::abs(r); });
}

/// What counts how much as parameters are fitted: what windows of tracks say counts most, since that is what is seen
/// when runs are told apart. Which effects there are is decided with all alike.
const Eigen::VectorXd& importance() {
  static const Eigen::VectorXd all = [] {
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

/// Steps within the box that lower the misfit most.
Eigen::VectorXd best_steps(const Surrogate& surrogate, const FloorBox& box) {
  const Eigen::Index columns = surrogate.slopes.cols();
  Eigen::VectorXd steps = Eigen::VectorXd::Zero(columns);
  const Eigen::VectorXd weights = weights_of(surrogate.off).cwiseProduct(importance());
  // Coordinate descent: small, and it keeps to the box. Parameters that the misfit hardly depends on stay.
  Eigen::VectorXd residual = surrogate.off;
  constexpr double kStay = 3;
  for (int sweep = 0; sweep < 300; ++sweep) {
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto slope = surrogate.slopes.col(p);
      const double curve = (weights.array() * slope.array().square()).sum() + kStay;
      const double pull = (weights.array() * slope.array() * residual.array()).sum() + kStay * steps(p);
      const auto q = static_cast<std::size_t>(p);
      const double to = std::clamp(steps(p) - pull / curve, box.least[q], box.most[q]);
      residual += (to - steps(p)) * slope;
      steps(p) = to;
    }
  }
  return steps;
}

/// How often measured runs are simulated to say where a model stands.
constexpr int kEngineRuns = 1;
constexpr std::size_t kQuickRuns = 2;

FloorStatistics quick_statistics(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed) {
  const std::size_t scenes = target.scenes().size();
  std::vector<std::vector<RobotSums>> sums(scenes * kQuickRuns);
  in_parallel(target.threads(), sums.size(), [&](std::size_t i) {
    sums[i] = robot_sums(simulate_quickly(target.scenes()[i % scenes], target.floor(), settings, seed * 100 + i),
                         target.floor());
  });
  std::vector<RobotSums> all;
  for (std::vector<RobotSums>& run : sums)
    all.insert(all.end(), std::make_move_iterator(run.begin()), std::make_move_iterator(run.end()));
  return statistics_of(all);
}

/// What one says more than the other, less what chance makes of it.
std::vector<double> differences(const FloorStatistics& one, const FloorStatistics& other) {
  std::vector<double> more(one.value.size(), 0);
  for (std::size_t s = 0; s < more.size(); ++s) {
    const double difference = one.value[s] - other.value[s], chance = one.variance[s] + other.variance[s];
    if (std::isfinite(difference) && difference != 0)
      more[s] = difference * std::max(0.0, 1 - chance / (difference * difference));
  }
  return more;
}

/// The misfit as steps lower it: what is far off counts by its size, not by its square.
double robust_misfit(const FloorTarget& target, const FloorStatistics& at) {
  double sum = 0;
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    const double variance = target.tolerance()[s] + at.variance[s];
    const double off = (at.value[s] - target.statistics().value[s]) / std::sqrt(variance);
    if (std::isfinite(off) && target.tolerance()[s] > 0)
      sum += importance()(static_cast<Eigen::Index>(s)) * off * off * std::min(1.0, 3 / std::abs(off));
  }
  return sum;
}

}  // namespace

double fit(FloorModel& model, const FloorTarget& target, int rounds, double width, std::uint64_t seed,
           const FloorProgress& progress) {
  const std::vector<bool> all(model.values.size(), true);
  const std::size_t parameters = all.size(), runs = target.scenes().size();
  model.later = target.later();
  // Quick runs, brought near to the engine's by what these differ by where the search begins. The same chance for all, so that
  // misfits differ by what the models differ.
  const FloorStatistics engine = simulated_statistics(target, model.settings(), seed * 7 + 1, kEngineRuns);
  FloorStatistics quick = quick_statistics(target, model.settings(), seed * 7 + 2);
  const std::vector<double> more = differences(engine, quick);
  const auto said_by = [&](const FloorModel& of) {
    FloorStatistics at = quick_statistics(target, of.settings(), seed * 7 + 2);
    for (std::size_t s = 0; s < more.size(); ++s) at.value[s] += more[s];
    return at;
  };
  FloorStatistics at = said_by(model);
  double misfit = robust_misfit(target, at);
  FloorPoints points;
  // Points stay as wide apart as they were: what chance makes of slopes falls as they become more. Steps become shorter.
  constexpr double kLongest = 1.5, kShorter = 0.4;
  constexpr int kTries = 2;
  double most = kLongest;
  for (int round = 0; round < rounds; ++round) {
    // Four for each parameter: with less, what chance makes of the slopes leads steps astray. Later those from before count, too.
    add_points(points, model, target, all, (round == 0 ? 4 : 2) * parameters + 12, width, kExplored_s,
               seed * 10 + static_cast<std::uint64_t>(round));
    const Surrogate surrogate = surrogate_of(target, at, slopes_of(points, model, all, runs, width));
    const FloorModel before = model;
    // A step that leads away was too long for the surrogate.
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const Eigen::VectorXd steps = best_steps(surrogate, box_around(before, width, most));
      model.values = moved(before, {steps.data(), steps.data() + steps.size()}, width);
      const FloorStatistics there = said_by(model);
      const double now = robust_misfit(target, there);
      progress(fmt::format("misfit {:.0f} -> {:.0f} of {} statistics", misfit, now, target.size()));
      if (now < misfit) {
        misfit = now;
        at = there;
        break;
      }
      model = before;
      most *= kShorter;
    }
  }
  return target.misfit(at);
}

}  // namespace kilotwin::kilogrid
