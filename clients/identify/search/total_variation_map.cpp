#include "clients/identify/search/total_variation_map.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "clients/identify/search/product_functions.hpp"
#include "clients/identify/search/total_variation_solver.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Folds of the cross-validation. More leave more data in each fit, and cost a fit per penalty each.
constexpr std::size_t kMapFolds = 4;
/// Least cross-validated gain in log likelihood.
constexpr double kLeastMapEvidence = 15;
/// Fewest nodes along each axis: a smooth map has waves up to order eight, so that fewer nodes add nothing.
constexpr int kFewestNodes = 8;
/// Penalties that the cross-validation tries. Slopes between nodes below `soft` cost like squares, those above like
/// edges: the finest one, a usual one and a coarse one. A larger `soft` smooths more; more values cost one fit per fold
/// each.
constexpr double kSoftFine = 0.004, kSoftUsual = 0.01, kSoftCoarse = 0.04;
/// Power of the penalty that favours few high steps.
constexpr double kPowerOfSteps = 0.3;

/// Size of a usual effect on the target over that of a gain: maps are fitted in this unit, so that one penalty serves all targets.
double unit_of(Target target) {
  constexpr double kTurn_rad_s = 0.25;  // usual effect on turning; a larger value penalises its maps less
  return target == Target::kTurn ? kTurn_rad_s : 1;
}

/// Normal equations of the nodes near a robot's path, from the innovations.
class FineSums {
 public:
  FineSums(const MotionModel& model, const Block& map, NormalEquations& to)
      : model_(model), map_(map), fixed_{{map.basis.factors.begin(), map.basis.factors.end() - 1}}, to_(to) {}

  void start(const TrackFilter&) { active_.clear(); }
  void step(const StepRecord& record) {
    const Rates& r = record.rates;
    const StepJacobian ways = step_jacobian(record, model_.base.wheel_base_mm);
    for (Active& a : active_) a.pose.head<2>() += ways.by_heading * a.pose[2];
    in_contact_ = in_contact_ || record.in_contact();
    const int command = static_cast<int>(record.middle.commands.command);
    if (!record.middle.commands.driven() || (map_.during >> command & 1) == 0) return;
    const NodeGrid& g = to_.grid;
    const double u = std::clamp((record.middle.x_mm - g.x_mm) / g.pitch_mm, 0.0, g.columns - 1.001),
                 v = std::clamp((record.middle.y_mm - g.y_mm) / g.pitch_mm, 0.0, g.rows - 1.001);
    i_ = static_cast<int>(u);
    j_ = static_cast<int>(v);
    const double x = u - i_, y = v - j_;
    double size = 1;
    fixed_.evaluate(record.middle, 0, &size);
    if (size == 0) return;
    const Eigen::Vector3d force = size * record.h_s * ways.by_wheel * by_value(record, r);
    add(i_, j_, (1 - x) * (1 - y) * force);
    add(i_ + 1, j_, x * (1 - y) * force);
    add(i_, j_ + 1, (1 - x) * y * force);
    add(i_ + 1, j_ + 1, x * y * force);
  }
  void update(const Innovation& innovation, const Sample&) {
    if (std::exchange(in_contact_, false) || innovation.lost) {
      active_.clear();
      return;
    }
    std::erase_if(active_, [&](const Active& a) {
      return a.i < i_ - kReach || a.i > i_ + 1 + kReach || a.j < j_ - kReach || a.j > j_ + 1 + kReach;
    });
    Eigen::Matrix3d jacobian = innovation.jacobian;
    if (innovation.size == 2) jacobian.row(2).setZero();
    const Eigen::Matrix3d precision = innovation.covariance.inverse();
    for (Active& a : active_) a.seen = jacobian * a.pose;
    for (const Active& a : active_) {
      const Eigen::Vector3d weighed = precision * a.seen;
      to_.score[static_cast<Eigen::Index>(to_.grid.at(a.i, a.j))] += weighed.dot(innovation.difference);
      float* const row = to_.of(a.i, a.j) + (kAcross / 2) * kAcross + kAcross / 2;
      for (const Active& b : active_)
        row[(b.j - a.j) * kAcross + b.i - a.i] += static_cast<float>(weighed.dot(b.seen));
    }
    for (Active& a : active_) a.pose -= innovation.gain.topRows<3>() * a.seen;
  }

 private:
  struct Active {
    int i, j;
    Eigen::Vector3d pose, seen = Eigen::Vector3d::Zero();
  };
  /// Change of the wheels' speeds by the value of a node, mm/s per unit.
  [[nodiscard]] Eigen::Vector2d by_value(const StepRecord& record, const Rates& r) const {
    const double unit = unit_of(map_.target), half_base_mm = model_.base.wheel_base_mm / 2;
    if (map_.target == Target::kTurn) return {-half_base_mm * unit, half_base_mm * unit};
    double own = 0;
    map_.basis.evaluate(record.middle, 0, &own);
    constexpr double kLeastFactor = 0.05;  // keeps the quotient finite where the map stops the wheels
    const double factor = std::max(kLeastFactor, std::abs(1 + own));
    return {r.left_base_mm_s * r.left_gain / factor, r.right_base_mm_s * r.right_gain / factor};
  }
  void add(int i, int j, const Eigen::Vector3d& force) {
    for (Active& a : active_) {
      if (a.i != i || a.j != j) continue;
      a.pose += force;
      return;
    }
    active_.push_back({i, j, force});
  }

  const MotionModel& model_;
  const Block& map_;
  const Basis fixed_;  ///< known factors that multiply the map
  NormalEquations& to_;
  std::vector<Active> active_;
  int i_ = 0, j_ = 0;
  bool in_contact_ = false;
};

std::vector<NormalEquations> sums_of(const Fitter& fitter, const FitState& state, const Block& map,
                                     const NodeGrid& grid) {
  const MotionModel& model = state.model;
  const auto units = state.tracks.units();
  std::vector<NormalEquations> folds(std::min(kMapFolds, units.size()), NormalEquations(grid));
  os::in_parallel(folds.size(), fitter.threads(), [&](std::size_t f) {
    FineSums sums(model, map, folds[f]);
    for (std::size_t u = f; u < units.size(); u += folds.size()) {
      for (const TrackView* view : units[u]) {
        RobotBias bias = model.bias_of(view->track->robot);
        bias.covariance.setZero();
        TrackFilter filter(model, bias, view->track->robot, view->number);
        run_filter(filter, *view, view->track->samples.size(), sums);
      }
    }
  });
  return folds;
}

/// Whether a block is a smooth map of the speed or of the turn rate, up to known factors.
bool is_map(const Block& block) {
  if ((block.target != Target::kGain && block.target != Target::kTurn) || block.during != kDriven) return false;
  const Factor* const open = block.basis.only_open();
  return open != nullptr && open == &block.basis.factors.back() && is_of_place(*open) &&
         (open->shape == Shape::kCosines2 || open->shape == Shape::kCosines);
}

/// The known factors that multiply a map.
std::vector<Factor> fixed_factors(const Block& map) {
  return {map.basis.factors.begin(), map.basis.factors.end() - 1};
}

/// The visited area, with cells as fine as the samples are dense.
NodeGrid grid_of(const PreparedSet& set) {
  double x_low = 1e300, x_high = -1e300, y_low = 1e300, y_high = -1e300;
  std::vector<double> xs, ys;
  for (const TrackView& view : set.views()) {
    for (const Sample& s : view.track->samples) {
      xs.push_back(s.x_mm);
      ys.push_back(s.y_mm);
    }
  }
  const auto bounds = [](std::vector<double>& all, double& low, double& high) {
    const std::size_t few = all.size() / 500;
    low = stats::order_statistic(all, few) - 20;
    high = stats::upper_end(all, few) + 20;
  };
  bounds(xs, x_low, x_high);
  bounds(ys, y_low, y_high);
  // Samples per node, at least, and least pitch. Smaller ones make a finer raster, which costs time and follows chance.
  constexpr double kPerNode = 4, kFinest_mm = 10;
  constexpr int kMostNodes = 95;  // nodes along the longer side; more cost time by the square
  const double width = x_high - x_low, height = y_high - y_low;
  NodeGrid g;
  g.pitch_mm = std::max({kFinest_mm, std::sqrt(width * height * kPerNode / static_cast<double>(xs.size())),
                         std::max(width, height) / (kMostNodes - 2)});
  g.x_mm = x_low;
  g.y_mm = y_low;
  g.columns = static_cast<int>(std::ceil(width / g.pitch_mm)) + 1;
  g.rows = static_cast<int>(std::ceil(height / g.pitch_mm)) + 1;
  return g;
}

Block block_of(const NodeGrid& g, Target target, const Eigen::VectorXd& f) {
  Factor factor;
  factor.shape = Shape::kGrid;
  factor.axis.of = Covariate::kX;
  factor.and_axis.of = Covariate::kY;
  factor.low = g.x_mm;
  factor.high = g.x_mm + g.pitch_mm * (g.columns - 1);
  factor.and_low = g.y_mm;
  factor.and_high = g.y_mm + g.pitch_mm * (g.rows - 1);
  factor.count = static_cast<std::uint32_t>(g.columns);
  const Eigen::VectorXd values = unit_of(target) * f;
  factor.points.assign(values.data(), values.data() + values.size());
  return {target, Basis{{factor}}, kDriven};
}

/// The term with the fine map in place of its smooth ones.
Term with_map(const Term& term, const Block& map) {
  Term out = term;
  out.blocks.clear();
  std::vector<double> coefficients, precision;
  Eigen::Index first = 0;
  for (const Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    if (!is_map(block) || block.target != map.target) {
      out.blocks.push_back(block);
      for (Eigen::Index i = first; i < first + n; ++i) {
        coefficients.push_back(term.coefficients[i]);
        precision.push_back(term.precision[i]);
      }
    }
    first += n;
  }
  out.blocks.insert(out.blocks.begin(), map);
  coefficients.insert(coefficients.begin(), 1.0);
  precision.insert(precision.begin(), 0.01);
  out.coefficients =
      Eigen::Map<Eigen::VectorXd>(coefficients.data(), static_cast<Eigen::Index>(coefficients.size()));
  out.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), static_cast<Eigen::Index>(precision.size()));
  return out;
}

/// Sum of the term's smooth maps at the nodes.
Eigen::VectorXd sampled(const Term& term, const NodeGrid& grid, Target target) {
  Eigen::VectorXd f(static_cast<Eigen::Index>(grid.nodes()));
  std::array<double, kMostColumns> values;
  Situation s;
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      s.x_mm = grid.x_mm + i * grid.pitch_mm;
      s.y_mm = grid.y_mm + j * grid.pitch_mm;
      double gain = 1, sum = 0;
      Eigen::Index first = 0;
      for (const Block& block : term.blocks) {
        const auto n = static_cast<Eigen::Index>(block.basis.size());
        if (is_map(block) && block.target == target) {
          const Basis map{{block.basis.factors.back()}, block.basis.chosen};
          map.evaluate(s, 0, values.data());
          const double own =
              term.coefficients.segment(first, n).dot(Eigen::Map<const Eigen::VectorXd>(values.data(), n));
          gain *= 1 + own;
          sum += own;
        }
        first += n;
      }
      // Gains multiply, turn rates add up.
      f[static_cast<Eigen::Index>(grid.at(i, j))] = target == Target::kGain ? gain - 1 : sum / unit_of(target);
    }
  }
  return f;
}

/// A fitted map.
struct Fitted {
  NodeGrid grid;
  Target target;
  Eigen::VectorXd f;
  Variation by;
  std::vector<Factor> fixed;  ///< known factors that multiply it

  [[nodiscard]] Block block() const {
    Block product = block_of(grid, target, f);
    product.basis.factors.insert(product.basis.factors.begin(), fixed.begin(), fixed.end());
    return product;
  }
};

/// Unit of the penalty weight: the root of the information per node.
double unit_of_weight(const NormalEquations& all) {
  double sum = 0, count = 0;
  const Eigen::VectorXd rows = all.times(Eigen::VectorXd::Ones(all.score.size()));
  for (Eigen::Index n = 0; n < rows.size(); ++n) {
    if (rows[n] <= 0) continue;
    sum += rows[n];
    ++count;
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

/// The penalty with the largest cross-validated likelihood, and its gain over the present map.
double choose(const std::vector<NormalEquations>& folds, const NormalEquations& all,
              const std::vector<Variation>& tried, std::uint32_t threads, Fitted& map) {
  std::vector<double> gains(tried.size() * folds.size());
  os::in_parallel(gains.size(), threads, [&](std::size_t k) {
    const NormalEquations& out = folds[k % folds.size()];
    NormalEquations rest = all;
    rest.add(out, -1);
    const Eigen::VectorXd change = solve(rest, map.f, tried[k / folds.size()], {4, 12}) - map.f;
    gains[k] = out.score.dot(change) - 0.5 * change.dot(out.times(change));
  });
  double best = -1e300;
  for (std::size_t t = 0; t < tried.size(); ++t) {
    const auto first = gains.begin() + static_cast<std::ptrdiff_t>(t * folds.size());
    const double gain = std::accumulate(first, first + static_cast<std::ptrdiff_t>(folds.size()), 0.0);
    if (gain <= best) continue;
    best = gain;
    map.by = tried[t];
  }
  return best;
}

/// Doubles the resolution by interpolation.
void halve(Fitted& map) {
  const Block coarse = block_of(map.grid, map.target, map.f);
  map.grid.pitch_mm /= 2;
  map.grid.columns = 2 * map.grid.columns - 1;
  map.grid.rows = 2 * map.grid.rows - 1;
  map.f.resize(static_cast<Eigen::Index>(map.grid.nodes()));
  Situation s;
  for (int j = 0; j < map.grid.rows; ++j) {
    for (int i = 0; i < map.grid.columns; ++i) {
      s.x_mm = map.grid.x_mm + i * map.grid.pitch_mm;
      s.y_mm = map.grid.y_mm + j * map.grid.pitch_mm;
      coarse.basis.evaluate(s, 0, &map.f[static_cast<Eigen::Index>(map.grid.at(i, j))]);
    }
  }
  map.f /= unit_of(map.target);
}

}  // namespace

void fit_total_variation_map(const Fitter& fitter, FitState& state, std::size_t place) {
  const std::vector<Block>& had = state.model.terms[place].blocks;
  const auto first = std::find_if(had.begin(), had.end(), is_map);
  if (first == had.end()) return;
  Fitted map;
  map.target = first->target;
  map.grid = grid_of(state.tracks);
  if (map.grid.columns < kFewestNodes || map.grid.rows < kFewestNodes) return;
  map.fixed = fixed_factors(*first);
  map.f = sampled(state.model.terms[place], map.grid, map.target);
  FitState trial = state;
  trial.model.terms[place] = with_map(state.model.terms[place], map.block());
  double likelihood = fitter.log_likelihood(state);
  // Rounds, of which the last may halve the raster; each costs a fit of the map per fold.
  constexpr int kPasses = 3;
  // Nodes along the longer side from which on the raster is not halved in the last pass; a larger value makes finer and
  // slower maps.
  constexpr int kMostNodes = 190;
  for (int pass = 0; pass < kPasses; ++pass) {
    const bool finer = pass == 2 && std::max(map.grid.columns, map.grid.rows) * 2 - 1 < kMostNodes;
    if (finer) {
      halve(map);
      trial.model.terms[place].blocks.front() = map.block();
    }
    const std::vector<NormalEquations> folds =
        sums_of(fitter, trial, trial.model.terms[place].blocks.front(), map.grid);
    if (folds.size() < 2) return;
    NormalEquations all(map.grid);
    for (const NormalEquations& fold : folds) all.add(fold, 1);
    // The noise is refitted with the first map.
    if (pass != 1) {
      const double unit = unit_of_weight(all);
      std::vector<Variation> tried;
      const auto try_it = [&](double weight, double soft, double power) {
        if (pass == 0 || power == map.by.power) tried.push_back({weight * unit, soft, power});
      };
      for (const double weight : {0.6, 1.8, 5.4}) {
        try_it(weight, kSoftFine, 1);
        try_it(weight, kSoftUsual, kPowerOfSteps);
        if (pass == 0) try_it(weight, kSoftCoarse, 1);
      }
      const double gain = choose(folds, all, tried, fitter.threads(), map);
      if (pass == 0 && gain < kLeastMapEvidence) return;
    }
    map.f = solve(all, map.f, map.by, {6, 30});
    FitState next = trial;
    next.model.terms[place].blocks.front() = map.block();
    fitter.fit(next, 1);
    map.f *= next.model.terms[place].coefficients[0];
    next.model.terms[place].blocks.front() = map.block();
    next.model.terms[place].coefficients[0] = 1;
    const double found = fitter.log_likelihood(next);
    if (found < likelihood + kLeastMapEvidence) break;
    likelihood = found;
    trial = next;
    state = trial;
  }
}

}  // namespace kilotwin::identify
