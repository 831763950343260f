#include "clients/identify/kilogrid/floor_sensitivity.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/fast_swarm.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Experimental design: steps of the parameters, balanced in sign per parameter.
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

/// Shrinks a slope by its variance. Most statistics do not depend on a given parameter; the noise of their slopes
/// would shorten steps.
double beyond_chance(double slope, double variance, double times = 1) {
  return slope * std::max(0.0, 1 - times * variance / std::max(slope * slope, 1e-30));
}

std::vector<RobotSums> sums_at(const FloorTarget& target, const FloorSettings& settings, std::size_t which,
                               double longest_s, std::uint64_t seed) {
  FloorScene scene = target.scenes()[which];
  scene.duration_s = std::min(scene.duration_s, longest_s);
  return robot_sums(simulate_fast(scene, target.floor(), settings, seed), target.floor());
}

/// Regression of one statistic over the simulations where it is known.
class Lines {
 public:
  /// `x`: one column per run, then the parameters; `moving`: number of varied parameters. Rows have weights.
  Lines(Eigen::MatrixXd x, Eigen::VectorXd weight, Eigen::Index scenes, std::size_t moving)
      : x_(std::move(x)),
        weight_(std::move(weight)),
        scenes_(scenes),
        fitted_(scenes + static_cast<Eigen::Index>(moving)),
        all_(x_, weight_, scenes) {}

  /// Shrunken slopes; 0 with too little data.
  Eigen::VectorXd slopes(const std::vector<double>& y) const {
    const auto rows = static_cast<Eigen::Index>(y.size()), columns = x_.cols() - scenes_;
    const auto known =
        static_cast<Eigen::Index>(std::count_if(y.begin(), y.end(), [](double v) { return std::isfinite(v); }));
    if (known == rows) return line(x_, weight_, all_, Eigen::Map<const Eigen::VectorXd>(y.data(), rows));
    // Values beyond the fitted numbers; with fewer, a statistic counts as independent of the parameters.
    constexpr Eigen::Index kSpare = 5;
    if (known < fitted_ + kSpare) return Eigen::VectorXd::Zero(columns);
    Eigen::MatrixXd x(known, x_.cols());
    Eigen::VectorXd some(known), weight(known);
    for (Eigen::Index i = 0, k = 0; i < rows; ++i) {
      if (!std::isfinite(y[static_cast<std::size_t>(i)])) continue;
      x.row(k) = x_.row(i);
      weight(k) = weight_(i);
      some(k++) = y[static_cast<std::size_t>(i)];
    }
    return line(x, weight, Normal(x, weight, scenes_), some);
  }

 private:
  struct Normal {
    Eigen::MatrixXd inverse, variance;  ///< variance: of the estimates, for unit residual variance
    Normal(const Eigen::MatrixXd& x, const Eigen::VectorXd& weight, Eigen::Index scenes) {
      // A small ridge: a parameter at its bound moves to one side only, and a statistic may be unknown in a run.
      Eigen::MatrixXd normal = x.transpose() * weight.asDiagonal() * x;
      normal.diagonal().head(scenes).array() += 1e-6;
      normal.diagonal().tail(x.cols() - scenes).array() += 0.02 * weight.sum();
      inverse = normal.inverse();
      variance = inverse * (x.transpose() * weight.cwiseAbs2().asDiagonal() * x) * inverse;
    }
  };
  Eigen::VectorXd line(const Eigen::MatrixXd& x, const Eigen::VectorXd& weight, const Normal& normal,
                       const Eigen::VectorXd& y) const {
    const Eigen::VectorXd fitted = normal.inverse * (x.transpose() * weight.cwiseProduct(y));
    // Effective number of simulations (Kish).
    const double effective = weight.sum() * weight.sum() / weight.squaredNorm();
    const double spare = std::max(effective - static_cast<double>(fitted_), 0.1 * effective);
    const double variance = (y - x * fitted).cwiseAbs2().dot(weight) / weight.sum() * effective / spare;
    Eigen::VectorXd slopes(x.cols() - scenes_);
    for (Eigen::Index p = 0; p < slopes.size(); ++p)
      slopes(p) = beyond_chance(fitted(scenes_ + p), variance * normal.variance(scenes_ + p, scenes_ + p));
    return slopes;
  }

  Eigen::MatrixXd x_;
  Eigen::VectorXd weight_;
  Eigen::Index scenes_, fitted_;
  Normal all_;
};

/// Pooled mean over robots, with each robot's contribution to its deviation.
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

void add_points(FloorPoints& points, const FloorModel& model, const FloorTarget& target,
                const std::vector<bool>& moves, std::size_t more, double width, double longest_s,
                std::uint64_t seed) {
  const std::size_t parameters = model.values.size(), runs = target.scenes().size(), before = points.run.size();
  Dice dice(seed);
  auto design = design_of(parameters, more, dice);
  for (std::size_t i = 0; i < more; ++i) {
    for (std::size_t p = 0; p < parameters; ++p) design[i][p] = moves[p] ? design[i][p] : 0;
    points.values.push_back(moved(model, design[i], width));
    points.run.push_back(i % runs);
  }
  points.said.resize(before + more);
  os::in_parallel(more, target.threads(), [&](std::size_t i) {
    const std::size_t run = points.run[before + i];
    points.said[before + i] =
        statistics_of(sums_at(target, model.settings(points.values[before + i]), run, longest_s, seed * 1000 + run))
            .value;
  });
}

Eigen::MatrixXd slopes_of(const FloorPoints& points, const FloorModel& model, const std::vector<bool>& moves,
                          std::size_t runs, double width) {
  const std::vector<FloorParameter> parameters = model.parameters();
  // One intercept per measured run: its initial state and random numbers.
  const auto rows = static_cast<Eigen::Index>(points.run.size()),
             columns = static_cast<Eigen::Index>(parameters.size()), scenes = static_cast<Eigen::Index>(runs);
  const auto moving = static_cast<std::size_t>(std::count(moves.begin(), moves.end(), true));
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(rows, scenes + columns);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    x(i, static_cast<Eigen::Index>(points.run[k])) = 1;
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto q = static_cast<std::size_t>(p);
      // The step actually taken within the parameter's range.
      x(i, scenes + p) = (points.values[k][q] - model.values[q]) / (width * parameters[q].width);
    }
    // A design within the width has mean square one third. Farther simulations are nonlinear: smaller weight.
    const double far =
        3 * x.row(i).tail(columns).squaredNorm() / static_cast<double>(std::max<std::size_t>(moving, 1));
    weight(i) = std::exp(-std::max(far - 1, 0.0) / 2);
  }
  const Lines lines(std::move(x), std::move(weight), scenes, moving);
  Eigen::MatrixXd slopes(static_cast<Eigen::Index>(statistic_count()), columns);
  std::vector<double> y(points.run.size());
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    for (std::size_t i = 0; i < y.size(); ++i) y[i] = points.said[i][s];
    slopes.row(static_cast<Eigen::Index>(s)) = lines.slopes(y);
  }
  return slopes;
}

Eigen::MatrixXd slopes_around(const FloorModel& model, const FloorTarget& target, const std::vector<bool>& moves,
                              double width, double longest_s, std::uint64_t seed) {
  const auto moving = static_cast<std::size_t>(std::count(moves.begin(), moves.end(), true));
  FloorPoints points;
  // Three simulations per parameter: fewer make the slopes too noisy.
  add_points(points, model, target, moves, 3 * moving + 12, width, longest_s, seed);
  return slopes_of(points, model, moves, target.scenes().size(), width);
}

void add_slopes_of_switches(Eigen::MatrixXd& slopes, const FloorModel& model, const FloorTarget& target,
                            const std::vector<std::size_t>& switches, double longest_s, std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  // Simulated robot time for one amplitude's slopes. Small sets are repeated with other seeds.
  constexpr double kRobotTime_s = 6e5;
  double robot_time_s = 0;
  for (const FloorScene& scene : target.scenes())
    robot_time_s += std::min(scene.duration_s, longest_s) * static_cast<double>(scene.x_mm.size());
  const std::size_t scenes = target.scenes().size(),
                    runs = scenes * std::max<std::size_t>(static_cast<std::size_t>(kRobotTime_s / robot_time_s), 1);
  const std::size_t statistics = statistic_count();
  std::vector<std::vector<RobotSums>> none(runs);
  os::in_parallel(runs, target.threads(), [&](std::size_t i) {
    none[i] = sums_at(target, model.settings(), i % scenes, longest_s, seed * 1000 + 500 + i);
  });
  Pooled without(statistics);
  for (const auto& run : none) without.add(run);
  os::in_parallel(switches.size(), target.threads(), [&](std::size_t k) {
    const std::size_t p = switches[k];
    // Two-sided amplitudes are nearly linear, so a longer step has a better ratio of signal to noise.
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
      // With common random numbers, the spread of the paired differences is the noise.
      double chance = 0;
      for (std::size_t i = 0; i < runs; ++i) {
        for (std::size_t r = 0; r < on[i].size(); ++r) {
          const double differs = with.part(on[i][r], s) - without.part(none[i][r], s);
          chance += differs * differs;
        }
      }
      const double slope = (with.mean(s) - without.mean(s)) / widths;
      chance /= widths * widths;
      // Stronger shrinkage: hundreds of noisy slopes would hide the few real ones.
      constexpr double kTimes = 2;
      if (!std::isfinite(slope + chance)) continue;
      slopes(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(p)) = beyond_chance(slope, chance, kTimes);
    }
  });
}

}  // namespace kilotwin::kilogrid
