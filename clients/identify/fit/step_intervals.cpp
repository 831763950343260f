#include "clients/identify/fit/step_intervals.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "clients/identify/fit/profile.hpp"

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
  constexpr double kAlways = -1e5;  // value far before all data; points of constants lie before it
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

/// Radii within which neighbours are listed. The farther ones are sums of other kinds.
std::vector<StepInterval> radii_of(const MotionModel& model) {
  std::vector<StepInterval> all;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    for (const Block& block : model.terms[t].blocks) {
      for (const Factor& f : block.basis.factors) {
        if (!is_of_others(f.axis) || reach_mm(f.axis) > kListed_mm) continue;
        const double reach = reach_mm(f.axis);
        const bool known = std::any_of(all.begin(), all.end(),
                                       [&](const StepInterval& s) { return s.term == t && s.at == reach; });
        if (!known) all.push_back({t, f.axis, reach, true});
      }
    }
  }
  return all;
}

/// Whether this radius is that of a factor.
bool is_radius_of(const StepInterval& step, const Factor& f) {
  return step.is_radius && is_of_others(f.axis) && reach_mm(f.axis) == step.at;
}

/// The columns of a block that jump at a step, or depend on a radius, as flags of all products of the basis; empty: none.
std::vector<bool> jumping_products(const Basis& basis, const StepInterval& step) {
  std::vector<bool> jump;
  if (step.is_radius) {
    if (std::none_of(basis.factors.begin(), basis.factors.end(),
                     [&](const Factor& f) { return is_radius_of(step, f); }))
      return jump;
    std::size_t products = 1;
    for (const Factor& f : basis.factors) products *= f.size();
    jump.assign(products, true);
    return jump;
  }
  for (std::size_t f = 0; f < basis.factors.size(); ++f) {
    const Factor& factor = basis.factors[f];
    if (factor.shape != Factor::Shape::kAtLeast || !(factor.axis == step.axis)) continue;
    const auto at = std::find(factor.points.begin(), factor.points.end(), step.at);
    if (at == factor.points.end()) continue;
    std::size_t before = 1, after = 1;
    for (std::size_t g = 0; g < basis.factors.size(); ++g) (g < f ? before : after) *= basis.factors[g].size();
    after /= factor.size();
    const auto own = static_cast<std::size_t>(at - factor.points.begin());
    for (std::size_t i = 0; i < before * factor.size() * after; ++i)
      jump.push_back(!factor.known.empty() || i / after % factor.size() == own);
    return jump;
  }
  return jump;
}

/// The block with the point of a step elsewhere, or with another radius, at most the farthest that has a list.
Block moved(Block block, const StepInterval& step, double by) {
  constexpr double kLeast_mm = 10;  // least radius, within a disc, where no neighbour can be
  for (Factor& f : block.basis.factors) {
    if (is_radius_of(step, f)) {
      f.axis.within_mm = static_cast<float>(std::clamp(step.at + by, kLeast_mm, kListed_mm));
      // Its columns end at the radius.
      if (f.shape == Factor::Shape::kTaper && f.axis.of == Covariate::kNearest) f.high = f.axis.within_mm;
      continue;
    }
    if (f.shape != Factor::Shape::kAtLeast || !(f.axis == step.axis)) continue;
    for (double& point : f.points)
      if (point == step.at) point += by;
  }
  return block;
}

/// How far the i-th place of a step or radius lies from the middle of all.
double move_of_place(int i, double finest) { return move_of(i / 2, finest) * (i % 2 == 0 ? -1 : 1); }

/// The jump of a term at a step, with the step at each of its places, about `middle` from where it is: one sum of columns per place, the
/// present one last.
struct Jumps {
  ColumnSums sums;
  std::vector<Eigen::Index> columns;  ///< of the model, which the jump replaces
};
Jumps jumps_of(const MotionModel& model, const StepInterval& step, double middle) {
  Jumps out;
  std::size_t index = 0;
  const double finest = finest_of(step.axis);
  Eigen::Index column = kBaseColumns;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    Eigen::Index first = 0;
    for (const Block& block : model.terms[t].blocks) {
      const std::size_t of = index++;
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      Eigen::VectorXd own = model.terms[t].coefficients.segment(first, n);
      const std::vector<bool> jump = t == step.term ? jumping_products(block.basis, step) : std::vector<bool>{};
      for (Eigen::Index i = 0; i < n && !jump.empty(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (jump[block.basis.chosen.empty() ? at : block.basis.chosen[at]])
          out.columns.push_back(column + first + i);
        else
          own[i] = 0;
      }
      first += n;
      if (jump.empty()) continue;
      for (int i = 0; i <= 2 * kMovesToASide; ++i) {
        const double by = i == 2 * kMovesToASide ? 0 : middle + move_of_place(i, finest);
        for (WeighedBlock& part : value_as_blocks(moved(block, step, by), own))
          out.sums.add(std::move(part.block), of, i, part.weight);
      }
    }
    column += model.terms[t].coefficients.size();
  }
  out.sums.finish(2 * kMovesToASide + 1);
  return out;
}

/// By how much the log likelihood rises if the jump is moved, all else at its most likely values, its size included. Without its
/// columns, the jump in place is an offset.
Eigen::VectorXd rises_of(const Fitter& fitter, const FitState& state, const Jumps& jumps) {
  const MotionModel& model = state.model;
  std::vector<Block> blocks = blocks_of(model);
  blocks.insert(blocks.end(), jumps.sums.blocks.begin(), jumps.sums.blocks.end());
  LineariseOptions options{100, fitter.threads()};
  options.of_block = &jumps.sums.of_block;
  const std::vector<Unit> units = linearise(model, state.tracks.units(), blocks, options);
  const Eigen::MatrixXd& weights = jumps.sums.weights;
  const Eigen::Index all = units.front().information.rows(), n = all - weights.rows();
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
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < n; ++i)
    if (std::find(jumps.columns.begin(), jumps.columns.end(), i) == jumps.columns.end()) others.push_back(i);
  const Eigen::MatrixXd cross = information.topRightCorner(n, all - n)(others, Eigen::all) * weights,
                        own = weights.transpose() * information.bottomRightCorner(all - n, all - n) * weights;
  const Eigen::VectorXd of_jumps = weights.transpose() * score.tail(all - n);
  const Eigen::LDLT<Eigen::MatrixXd> solver(information(others, others));
  const Eigen::Index in_place = weights.cols() - 1;
  const Eigen::VectorXd start = solver.solve(score(others) + cross.col(in_place));
  Eigen::VectorXd values(weights.cols());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double left = of_jumps[i] + own(i, in_place) - cross.col(i).dot(start),
                 size = own(i, i) - cross.col(i).dot(solver.solve(cross.col(i)));
    values[i] = size > 1e-12 * own(in_place, in_place) ? 0.5 * left * left / size : 0;
  }
  return (values.array() - values[in_place]).head(in_place);
}

/// Whether the likelihood has no corner: covariates other than a count change little where a robot crosses the radius.
bool is_smooth(const StepInterval& step) { return step.is_radius && step.axis.of != Covariate::kNeighbours; }

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
  const std::vector<StepInterval> radii = radii_of(state.model);
  steps.insert(steps.end(), radii.begin(), radii.end());
  for (StepInterval& step : steps) {
    const double finest = finest_of(step.axis),
                 most = (is_smooth(step) ? kProfileDrop95 : kStepDrop95) * uncertainty.dispersion;
    Jumps jumps = jumps_of(state.model, step, 0);
    if (jumps.sums.blocks.empty()) continue;
    Eigen::VectorXd rises = rises_of(fitter, state, jumps);
    double middle = 0, highest = 0;
    // The search knows radii to a millimetre; the data may know them better.
    constexpr int kMostRounds = 2;
    for (int round = 0; step.is_radius && round < kMostRounds; ++round) {
      int best = 0;
      const double rise = rises.maxCoeff(&best);
      if (!(rise > highest + 0.1 * most)) break;
      highest = rise;
      middle += move_of_place(best, finest);
      jumps = jumps_of(state.model, step, middle);
      rises = rises_of(fitter, state, jumps);
    }
    highest = std::max(highest, rises.maxCoeff());
    // Of a radius, the interval holds the value that the model has, and what the noise of measured distances may hide.
    const double least = step.is_radius ? std::sqrt(state.model.noise.position_mm2) : 0;
    if (const auto below = end_of(rises, 0, highest, most, finest))
      step.low = step.at + (step.is_radius ? std::min(0.0, middle - *below) - least : -*below);
    if (const auto above = end_of(rises, 1, highest, most, finest))
      step.high = step.at + (step.is_radius ? std::max(0.0, middle + *above) + least : *above);
  }
  return steps;
}

}  // namespace kilotwin::identify
