#include "clients/identify/fit/step_intervals.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace kilotwin::identify {
namespace {

/// Distances to which a point is moved, relative to its unit: finer near the point.
constexpr int kMovesToASide = 14;
constexpr double kRatio = 1.9;
double move_of(int i, double finest) { return finest * std::pow(kRatio, i); }

/// Finest move, in the unit of the covariate: below what the sub-steps of the filter and the tracker resolve.
double finest_of(const Axis& axis) {
  constexpr double kFinest_s = 0.02, kFinest_mm = 0.1, kFinest = 0.01;
  const std::string unit = unit_of(axis.of);
  return unit == "s" ? kFinest_s : unit == "mm" ? kFinest_mm : kFinest;
}

/// A step before all data is a constant.
bool is_in_data(const Factor& f, double point) {
  constexpr double kAlways = -1e5;
  return f.shape == Factor::Shape::kAtLeast && point > kAlways && (f.axis.of != Covariate::kTime || point > 0);
}

/// Whether the covariate varies continuously: an interval of a count says nothing.
bool is_continuous(const Axis& axis) { return *unit_of(axis.of) != 0; }

std::vector<StepInterval> steps_of(const MotionModel& model) {
  std::vector<StepInterval> all;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    for (const Block& block : model.terms[t].blocks) {
      for (const Factor& f : block.basis.factors) {
        if (f.shape != Factor::Shape::kAtLeast) continue;
        for (const double point : f.points) {
          const bool known = std::any_of(all.begin(), all.end(), [&](const StepInterval& s) {
            return s.term == t && s.axis == f.axis && s.at == point;
          });
          if (!known && is_in_data(f, point) && is_continuous(f.axis)) all.push_back({t, f.axis, point});
        }
      }
    }
  }
  return all;
}

/// The block with the point elsewhere; nothing if it has no such point.
std::optional<Block> moved(const Block& block, const StepInterval& step, double by) {
  Block out = block;
  bool any = false;
  for (Factor& f : out.basis.factors) {
    if (f.shape != Factor::Shape::kAtLeast || !(f.axis == step.axis)) continue;
    for (double& point : f.points) {
      if (point != step.at) continue;
      point += by;
      any = true;
    }
  }
  return any ? std::optional(out) : std::nullopt;
}

/// The change of the effects by each move of a step: one sum of columns per move.
ColumnSums changes_of(const MotionModel& model, const StepInterval& step) {
  ColumnSums sums;
  std::size_t index = 0;
  const double finest = finest_of(step.axis);
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    Eigen::Index first = 0;
    for (const Block& block : model.terms[t].blocks) {
      const std::size_t of = index++;
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      const Eigen::VectorXd own = model.terms[t].coefficients.segment(first, n);
      first += n;
      if (t != step.term || !moved(block, step, 0)) continue;
      for (int i = 0; i < 2 * kMovesToASide; ++i) {
        const double by = move_of(i / 2, finest) * (i % 2 == 0 ? -1 : 1);
        for (WeighedBlock& part : value_as_blocks(*moved(block, step, by), own))
          sums.add(std::move(part.block), of, i, part.weight);
      }
      for (WeighedBlock& part : value_as_blocks(block, own))
        sums.add(std::move(part.block), of, 2 * kMovesToASide, part.weight);
    }
  }
  sums.finish(2 * kMovesToASide + 1);
  // The moved effect less the one in place.
  const Eigen::VectorXd in_place = sums.weights.col(2 * kMovesToASide);
  sums.weights = (sums.weights.leftCols(2 * kMovesToASide).colwise() - in_place).eval();
  return sums;
}

/// By how much the log likelihood rises with each move, all else at its most likely values.
Eigen::VectorXd rises_of(const Fitter& fitter, const FitState& state, const ColumnSums& changes) {
  const MotionModel& model = state.model;
  std::vector<Block> blocks = blocks_of(model);
  blocks.insert(blocks.end(), changes.blocks.begin(), changes.blocks.end());
  LineariseOptions options{100, fitter.threads()};
  options.of_block = &changes.of_block;
  const std::vector<Unit> units = linearise(model, state.tracks.units(), blocks, options);
  const Eigen::Index all = units.front().information.rows(), n = all - changes.weights.rows();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd score = Eigen::VectorXd::Zero(all);
  for (const Unit& unit : units) {
    information += unit.information;
    score += unit.score;
  }
  fitter.add_base_prior(model, information, score);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    const Eigen::Index own = term.coefficients.size();
    information.diagonal().segment(first, own) += term.precision;
    score.segment(first, own) -= term.precision.cwiseProduct(term.coefficients);
    first += own;
  }
  const Eigen::MatrixXd cross = information.topRightCorner(n, all - n) * changes.weights;
  const Eigen::LDLT<Eigen::MatrixXd> solver(information.topLeftCorner(n, n));
  const Eigen::VectorXd of_changes = changes.weights.transpose() * score.tail(all - n);
  const Eigen::MatrixXd own =
      changes.weights.transpose() * information.bottomRightCorner(all - n, all - n) * changes.weights;
  const Eigen::VectorXd start = score.head(n);
  const double before = 0.5 * start.dot(solver.solve(start));
  Eigen::VectorXd rises(cross.cols());
  for (Eigen::Index i = 0; i < rises.size(); ++i) {
    const Eigen::VectorXd left = start - cross.col(i);
    rises[i] = of_changes[i] - 0.5 * own(i, i) + 0.5 * left.dot(solver.solve(left)) - before;
  }
  return rises;
}

/// Where the likelihood has fallen by `most` below its maximum on one side, between the moves; nothing: nowhere.
std::optional<double> end_of(const Eigen::VectorXd& rises, int side, double highest, double most, double finest) {
  // The farthest move that is likely enough, so that a hole in the likelihood does not end the interval.
  int last = -1;
  for (int i = 0; i < kMovesToASide; ++i)
    if (rises[2 * i + side] > highest - most) last = i;
  if (last + 1 == kMovesToASide) return std::nullopt;
  const double inside = last < 0 ? 0 : move_of(last, finest), outside = move_of(last + 1, finest),
               from = highest - (last < 0 ? 0 : rises[2 * last + side]),
               to = highest - rises[2 * (last + 1) + side];
  return inside + (outside - inside) * std::clamp((most - from) / std::max(to - from, 1e-9), 0.0, 1.0);
}

}  // namespace

std::vector<StepInterval> step_intervals_of(const Fitter& fitter, const FitState& state,
                                            const Uncertainty& uncertainty) {
  std::vector<StepInterval> steps = steps_of(state.model);
  for (StepInterval& step : steps) {
    const ColumnSums changes = changes_of(state.model, step);
    if (changes.blocks.empty()) continue;
    const Eigen::VectorXd rises = rises_of(fitter, state, changes);
    const double highest = std::max(0.0, rises.maxCoeff()), finest = finest_of(step.axis),
                 most = kStepDrop95 * uncertainty.dispersion;
    if (const auto below = end_of(rises, 0, highest, most, finest)) step.low = step.at - *below;
    if (const auto above = end_of(rises, 1, highest, most, finest)) step.high = step.at + *above;
  }
  return steps;
}

}  // namespace kilotwin::identify
