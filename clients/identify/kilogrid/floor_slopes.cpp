#include "clients/identify/kilogrid/floor_slopes.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/quick_swarm.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Where a model of some parameters stands on a design of runs, in steps: each parameter balanced between up and down.
std::vector<std::vector<double>> design_of(std::size_t parameters, std::size_t points, Dice& dice) {
  std::vector<std::vector<double>> design(points, std::vector<double>(parameters, 0));
  for (std::size_t p = 0; p < parameters; ++p) {
    std::vector<double> levels;
    for (std::size_t i = 0; i < points; ++i)
      levels.push_back(2 * (static_cast<double>(i) + 0.5) / static_cast<double>(points) - 1);
    for (std::size_t i = points; i-- > 1;) std::swap(levels[i], levels[dice.bits() % (i + 1)]);
    for (std::size_t i = 0; i < points; ++i) design[i][p] = levels[i];
  }
  return design;
}

/// A slope with this variance, less what chance makes of it. Many statistics do not depend on a parameter; what chance makes of
/// those would only dampen steps.
double beyond_chance(double slope, double variance, double times = 1) {
  return slope * std::max(0.0, 1 - times * variance / std::max(slope * slope, 1e-30));
}

std::vector<RobotSums> sums_at(const FloorTarget& target, const FloorSettings& settings, std::size_t which,
                               double longest_s, std::uint64_t seed) {
  FloorScene scene = target.scenes()[which];
  scene.duration_s = std::min(scene.duration_s, longest_s);
  return robot_sums(simulate_quickly(scene, target.floor(), settings, seed), target.floor());
}

/// Regression of one statistic over the points at which it is known.
class Lines {
 public:
  /// `x`: a column per run, then the parameters'; `moving`: of those, how many are not 0 throughout.
  Lines(Eigen::MatrixXd x, Eigen::Index scenes, std::size_t moving)
      : x_(std::move(x)),
        scenes_(scenes),
        fitted_(scenes + static_cast<Eigen::Index>(moving)),
        all_(inverse_of(x_)) {}

  /// Slopes less what chance makes of them; none where too little is known.
  Eigen::VectorXd slopes(const std::vector<double>& y) const {
    const auto rows = static_cast<Eigen::Index>(y.size()), columns = x_.cols() - scenes_;
    const auto known =
        static_cast<Eigen::Index>(std::count_if(y.begin(), y.end(), [](double v) { return std::isfinite(v); }));
    if (known == rows) return line(x_, all_, Eigen::Map<const Eigen::VectorXd>(y.data(), rows));
    constexpr Eigen::Index kSpare = 5;
    if (known < fitted_ + kSpare) return Eigen::VectorXd::Zero(columns);
    Eigen::MatrixXd x(known, x_.cols());
    Eigen::VectorXd some(known);
    for (Eigen::Index i = 0, k = 0; i < rows; ++i) {
      if (!std::isfinite(y[static_cast<std::size_t>(i)])) continue;
      x.row(k) = x_.row(i);
      some(k++) = y[static_cast<std::size_t>(i)];
    }
    return line(x, inverse_of(x), some);
  }

 private:
  Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& x) const {
    // A little ridge: a parameter at the end of its range moves to one side only, and a run may lack the statistic.
    Eigen::MatrixXd normal = x.transpose() * x;
    normal.diagonal().head(scenes_).array() += 1e-6;
    normal.diagonal().tail(x.cols() - scenes_).array() += 0.02 * static_cast<double>(x.rows());
    return normal.inverse();
  }
  Eigen::VectorXd line(const Eigen::MatrixXd& x, const Eigen::MatrixXd& inverse, const Eigen::VectorXd& y) const {
    const Eigen::VectorXd fitted = inverse * (x.transpose() * y);
    const double spare = std::max(static_cast<double>(x.rows() - fitted_), 1.0);
    const double variance = (y - x * fitted).squaredNorm() / spare;
    Eigen::VectorXd slopes(x.cols() - scenes_);
    for (Eigen::Index p = 0; p < slopes.size(); ++p)
      slopes(p) = beyond_chance(fitted(scenes_ + p), variance * inverse(scenes_ + p, scenes_ + p));
    return slopes;
  }

  Eigen::MatrixXd x_;
  Eigen::Index scenes_, fitted_;
  Eigen::MatrixXd all_;
};

/// Adds to a mean over robots, with what each contributes to its deviation.
struct Pooled {
  std::vector<double> sum, weight;
  explicit Pooled(std::size_t n) : sum(n, 0), weight(n, 0) {}
  void add(const std::vector<RobotSums>& robots) {
    for (const RobotSums& robot : robots) {
      for (std::size_t s = 0; s < sum.size(); ++s) {
        sum[s] += robot.sum[s];
        weight[s] += robot.weight[s];
      }
    }
  }
  [[nodiscard]] double mean(std::size_t s) const { return sum[s] / weight[s]; }
  [[nodiscard]] double part(const RobotSums& robot, std::size_t s) const {
    return (robot.sum[s] - mean(s) * robot.weight[s]) / weight[s];
  }
};

}  // namespace

FloorBox box_around(const FloorModel& model, double width, double most) {
  const std::vector<FloorParameter> parameters = model.parameters();
  FloorBox box;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const double step = width * parameters[p].width;
    box.least.push_back(std::max(-most, std::min((parameters[p].least - model.values[p]) / step, 0.0)));
    box.most.push_back(std::min(most, std::max((parameters[p].most - model.values[p]) / step, 0.0)));
  }
  return box;
}

std::vector<double> moved(const FloorModel& model, const std::vector<double>& steps, double width) {
  const std::vector<FloorParameter> parameters = model.parameters();
  std::vector<double> to;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const FloorParameter& parameter = parameters[p];
    to.push_back(std::clamp(model.values[p] + steps[p] * width * parameter.width, parameter.least, parameter.most));
  }
  return to;
}

Eigen::MatrixXd slopes_around(const FloorModel& model, const FloorTarget& target, const std::vector<bool>& moves,
                              double width, double longest_s, std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const auto moving = static_cast<std::size_t>(std::count(moves.begin(), moves.end(), true));
  // Four for each: with less, what chance makes of the slopes leads steps astray.
  const std::size_t points = 4 * moving + 12, runs = target.scenes().size();
  Dice dice(seed);
  auto design = design_of(parameters.size(), points, dice);
  std::vector<std::vector<double>> at(points);
  for (std::size_t i = 0; i < points; ++i) {
    for (std::size_t p = 0; p < parameters.size(); ++p) design[i][p] = moves[p] ? design[i][p] : 0;
    at[i] = moved(model, design[i], width);
  }
  std::vector<FloorStatistics> results(points);
  in_parallel(target.threads(), points, [&](std::size_t i) {
    const std::size_t run = i % runs;
    results[i] = statistics_of(sums_at(target, model.settings(at[i]), run, longest_s, seed * 1000 + run));
  });

  // Each run has a column of its own, for what it has begun with and for its random numbers.
  const auto rows = static_cast<Eigen::Index>(points), columns = static_cast<Eigen::Index>(parameters.size());
  const auto scenes = static_cast<Eigen::Index>(runs);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(rows, scenes + columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    x(i, i % scenes) = 1;
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto q = static_cast<std::size_t>(p);
      // What was really done, within the parameter's range.
      x(i, scenes + p) = (at[static_cast<std::size_t>(i)][q] - model.values[q]) / (width * parameters[q].width);
    }
  }
  const Lines lines(std::move(x), scenes, moving);
  Eigen::MatrixXd slopes(static_cast<Eigen::Index>(statistic_count()), columns);
  std::vector<double> y(points);
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    for (std::size_t i = 0; i < points; ++i) y[i] = results[i].value[s];
    slopes.row(static_cast<Eigen::Index>(s)) = lines.slopes(y);
  }
  return slopes;
}

void add_slopes_of_switches(Eigen::MatrixXd& slopes, const FloorModel& model, const FloorTarget& target,
                            const std::vector<std::size_t>& switches, double longest_s, std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  // So much tells a switch's slopes: of all runs that were measured, those of small sets again with other numbers.
  constexpr double kRobotTime_s = 6e5;
  double robot_time_s = 0;
  for (const FloorScene& scene : target.scenes())
    robot_time_s += std::min(scene.duration_s, longest_s) * static_cast<double>(scene.x_mm.size());
  const std::size_t scenes = target.scenes().size(),
                    runs = scenes * std::max<std::size_t>(static_cast<std::size_t>(kRobotTime_s / robot_time_s), 1);
  const std::size_t statistics = statistic_count();
  std::vector<std::vector<RobotSums>> none(runs);
  in_parallel(target.threads(), runs, [&](std::size_t i) {
    none[i] = sums_at(target, model.settings(), i % scenes, longest_s, seed * 1000 + 500 + i);
  });
  Pooled without(statistics);
  for (const auto& run : none) without.add(run);
  in_parallel(target.threads(), switches.size(), [&](std::size_t k) {
    const std::size_t p = switches[k];
    // What goes both ways is nearly linear, so that a longer step tells more; what only grows need not be.
    std::vector<double> values = model.values;
    values[p] = std::min(values[p] + (parameters[p].least < 0 ? 2 : 1) * parameters[p].width, parameters[p].most);
    const double widths = (values[p] - model.values[p]) / parameters[p].width;
    std::vector<std::vector<RobotSums>> on;
    Pooled with(statistics);
    for (std::size_t i = 0; i < runs; ++i) {
      on.push_back(sums_at(target, model.settings(values), i % scenes, longest_s, seed * 1000 + 500 + i));
      with.add(on.back());
    }
    for (std::size_t s = 0; s < statistics; ++s) {
      // Robots with the same numbers differ by what is switched: so chance is what these differences spread by.
      double chance = 0;
      for (std::size_t i = 0; i < runs; ++i) {
        for (std::size_t r = 0; r < on[i].size(); ++r) {
          const double differs = with.part(on[i][r], s) - without.part(none[i][r], s);
          chance += differs * differs;
        }
      }
      const double slope = (with.mean(s) - without.mean(s)) / widths;
      chance /= widths * widths;
      // Hundreds of slopes that are chance would together hide the few that are not.
      constexpr double kTimes = 2;
      if (!std::isfinite(slope + chance)) continue;
      slopes(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(p)) = beyond_chance(slope, chance, kTimes);
    }
  });
}

}  // namespace kilotwin::kilogrid
