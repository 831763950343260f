#include "clients/identify/search/shape_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "clients/identify/search/local_quadratic.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Convergence: gain in log likelihood of one more pass.
constexpr double kSettled = 1;
/// Pruning threshold of a column: its prior sd times the root of its information.
constexpr double kFaint = 0.03;

/// Covariates that are 0 without neighbours. Most robots have none for most of the time, so that a curve which is not 0 there would
/// be confounded with the base speeds.
bool is_0_when_alone(const Axis& axis) {
  return axis.of == Covariate::kNeighbours || axis.of == Covariate::kDensity;
}

}  // namespace

Factor richer(Factor f) {
  if (!f.known.empty()) return f;
  if (is_0_when_alone(f.axis) && (f.shape == Shape::kLinear || f.shape == Shape::kCosines)) {
    f.shape = Shape::kLevelling;
    f.points = {f.high / 16, f.high / 8, f.high / 4, f.high / 2, f.high, 2 * f.high};
    return f;
  }
  switch (f.shape) {
    case Shape::kLinear:
      f.shape = Shape::kCosines;
      f.first = 1;
      f.count = 16;
      break;
    case Shape::kCosines:
      switch (f.axis.of) {
        case Covariate::kTime: f.count = 64; break;
        case Covariate::kX:
        case Covariate::kPointDistance:
        case Covariate::kAlong:
        case Covariate::kY: f.count = 40; break;
        case Covariate::kSinceCommand:
          f.count = 40;
          f.warp = 0.5;
          break;
        default: f.count = 24; break;
      }
      break;
    case Shape::kCosines2: f.count = 11; break;
    case Shape::kPolynomials2: f.count = 7; break;
    case Shape::kHarmonics: f.count = f.axis.of == Covariate::kBearing ? 3 : 10; break;
    case Shape::kTaper:
    case Shape::kTravelling: f.count = 6; break;
    case Shape::kExponential: f.points = {0.25, 0.5, 1, 2, 4, 8}; break;
    case Shape::kAtLeast:
      if (f.axis.of != Covariate::kTime) break;
      // change_points.hpp finds the times of steps.
      f.shape = Shape::kCosines;
      f.first = 1;
      f.count = 64;
      f.points.clear();
      break;
    case Shape::kTable:
    case Shape::kPointShift:
    case Shape::kLevelling:
    case Shape::kGrid:
    case Shape::kWave: break;
  }
  return f;
}

namespace {

/// Columns beyond a map's order, along one axis.
Basis along(Basis basis, bool second) {
  Factor& f = *basis.only_open();
  const Factor map = f;
  f.shape = Shape::kCosines;
  f.first = map.count + 1;
  f.count = 20;
  if (second) {
    f.axis = map.and_axis;
    f.low = map.and_low;
    f.high = map.and_high;
  }
  return basis;
}

/// A table times another factor, with only the keys that occur in a chosen column.
Basis with_chosen_keys(Basis basis) {
  if (basis.factors.size() != 2 || basis.only_open() != nullptr || basis.factors.front().shape != Shape::kTable ||
      basis.chosen.empty())
    return basis;
  const std::size_t each = basis.factors[1].size();
  std::vector<double> kept;
  const std::vector<double>& keys = basis.factors.front().points;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool used = std::any_of(basis.chosen.begin(), basis.chosen.end(),
                                  [&](std::uint32_t column) { return column / each == i; });
    if (used) kept.push_back(keys[i]);
  }
  basis.factors.front().points = kept;
  return basis;
}

/// Limits the number of cosines in products.
void shorten(Basis& basis) {
  if (basis.only_open() != nullptr || basis.factors.size() < 2) return;
  constexpr std::uint32_t kOfARobot = 6;  // cosines per robot; more follow the chance of one robot's track
  const bool of_robots = basis.looks_at(Covariate::kRobot);
  for (Factor& factor : basis.factors) {
    if (factor.shape != Shape::kCosines || !factor.known.empty()) continue;
    const auto walls = static_cast<std::uint32_t>(kMostColumns * factor.count / basis.size());
    factor.count = std::clamp(of_robots ? std::min(walls, kOfARobot) : walls, 1u, factor.count);
    // Includes the constant of each robot.
    if (of_robots) factor.first = 0;
  }
}

/// Whether a constant is identifiable: for drift and slip, since biases cannot absorb it.
bool has_constant_part(const Block& block) {
  const Target target = block.target;
  return target == Target::kWorldX || target == Target::kWorldY || target == Target::kSideways;
}

/// Whether known factors multiply a curve or a map. Such a term keeps its columns (products.hpp).
bool is_product(const Term& term) {
  const std::vector<Factor>& factors = term.blocks.front().basis.factors;
  return factors.size() > 1 &&
         std::any_of(factors.begin(), factors.end(), [](const Factor& f) { return !f.known.empty(); });
}

/// Whether amplitudes of some keys begin at an instant (simplification.hpp). Curves in their place would lose the instants.
bool is_switch(const Term& term) {
  return std::all_of(term.blocks.begin(), term.blocks.end(), [](const Block& block) {
    const std::vector<Factor>& f = block.basis.factors;
    return f.size() == 2 && f[0].shape == Shape::kAtLeast && f[0].points.size() == 1 &&
           f[1].shape == Shape::kTable && f[0].known.empty() && f[1].known.empty();
  });
}

/// A single curve. Its column of frequency 0 is the constant.
bool is_curve(const Basis& basis) {
  const Factor* const open = basis.only_open();
  return open != nullptr && open->shape == Shape::kCosines;
}

/// Constant, up to known factors.
bool is_constant(const Basis& basis) {
  return std::all_of(basis.factors.begin(), basis.factors.end(), [](const Factor& f) { return !f.known.empty(); });
}

/// Whether a block holds columns beyond a map's order, added by an earlier refinement. It is then rebuilt.
bool lies_beyond_map(const Block& block, const std::vector<Block>& blocks) {
  const Factor* const open = block.basis.only_open();
  return open != nullptr && open->shape == Shape::kCosines && open->first > 1 &&
         std::any_of(blocks.begin(), blocks.end(), [&](const Block& other) {
           const Factor* const map = other.basis.only_open();
           return other.target == block.target && other.during == block.during && map != nullptr &&
                  map->shape == Shape::kCosines2;
         });
}

/// Whether a block holds the sudden changes of a curve (change_points.hpp). The curve then shows them, until they are found again.
bool lies_beside_curve(const Block& block, const std::vector<Block>& blocks) {
  const Factor* const steps = block.basis.only_open();
  return steps != nullptr && steps->shape == Shape::kAtLeast && steps->axis.of == Covariate::kTime &&
         std::any_of(blocks.begin(), blocks.end(), [&](const Block& other) {
           return other.target == block.target && other.during == block.during && is_curve(other.basis) &&
                  other.basis.only_open()->axis == steps->axis;
         });
}

std::vector<Block> richer(const Term& term) {
  std::vector<Block> blocks;
  for (const Block& block : term.blocks) {
    // A constant block beside a shape is part of that shape.
    if (is_constant(block.basis) && std::any_of(term.blocks.begin(), term.blocks.end(), [&](const Block& other) {
          return other.target == block.target && other.during == block.during && has_constant_part(other) &&
                 is_curve(other.basis);
        }))
      continue;
    if (lies_beyond_map(block, term.blocks) || lies_beside_curve(block, term.blocks)) continue;
    Block rich = block;
    rich.basis = with_chosen_keys(block.basis);
    rich.basis.chosen.clear();
    for (Factor& factor : rich.basis.factors) factor = richer(factor);
    if (has_constant_part(block) && is_curve(rich.basis)) rich.basis.only_open()->first = 0;
    shorten(rich.basis);
    // Camera drift is slow. calibration_shifts.hpp finds shifts.
    constexpr std::uint32_t kDrift = 24;
    if (is_measured(block.target))
      for (Factor& f : rich.basis.factors)
        if (f.shape == Shape::kCosines && f.axis.of == Covariate::kTime) f.count = std::min(f.count, kDrift);
    // Too many columns: keeps the present basis.
    if (rich.basis.size() > kMostColumns) rich.basis = block.basis;
    blocks.push_back(rich);
    if (const Factor* const open = rich.basis.only_open(); open != nullptr && open->shape == Shape::kCosines2) {
      const Basis map = rich.basis;
      for (const bool second : {false, true}) {
        rich.basis = along(map, second);
        blocks.push_back(rich);
      }
    }
  }
  // Maps have no constant column. If needed, a constant block is added.
  const std::vector<Block> shaped = blocks;
  for (const Block& block : shaped) {
    const Factor* const open = block.basis.only_open();
    if (!has_constant_part(block) || open == nullptr || !open->of_two()) continue;
    Block constant{block.target, {}, block.during};
    if (std::none_of(blocks.begin(), blocks.end(), [&](const Block& b) {
          return is_constant(b.basis) && b.target == constant.target && b.during == constant.during;
        }))
      blocks.push_back(constant);
  }
  return blocks;
}

bool same_axes(const Basis& a, const Basis& b) {
  if (a.factors.size() != b.factors.size()) return false;
  for (std::size_t i = 0; i < a.factors.size(); ++i) {
    const Factor &f = a.factors[i], &g = b.factors[i];
    if (f.shape != g.shape || !(f.axis == g.axis) || f.first != g.first) return false;
  }
  return true;
}
bool paired(Target a, Target b) {
  const auto pair = [](Target t) {
    switch (t) {
      case Target::kWorldY: return Target::kWorldX;
      case Target::kMeasuredY: return Target::kMeasuredX;
      case Target::kGainRight: return Target::kGainLeft;
      case Target::kOffsetRight: return Target::kOffsetLeft;
      default: return t;
    }
  };
  return pair(a) == pair(b);
}

/// Column groups of the blocks, by kind.
std::vector<ColumnGroup> groups_of(const std::vector<Block>& blocks) {
  std::vector<ColumnGroup> groups;
  std::vector<std::size_t> first_block;
  Eigen::Index next = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    std::size_t g = 0;
    while (g < groups.size() && !(paired(blocks[first_block[g]].target, blocks[b].target) &&
                                  blocks[first_block[g]].during == blocks[b].during &&
                                  same_axes(blocks[first_block[g]].basis, blocks[b].basis)))
      ++g;
    if (g == groups.size()) {
      groups.emplace_back();
      first_block.push_back(b);
    }
    for (const double rough : blocks[b].basis.roughness()) {
      groups[g].columns.push_back(next++);
      groups[g].roughness.push_back(rough);
    }
  }
  return groups;
}

/// Removes columns without influence.
void prune(Term& term, const Eigen::VectorXd& information) {
  std::vector<Block> blocks;
  std::vector<double> coefficients, precision;
  Eigen::Index first = 0;
  for (Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    std::vector<std::uint32_t> kept;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::sqrt(information[first + i] / term.precision[first + i]) < kFaint) continue;
      kept.push_back(block.basis.chosen.empty() ? static_cast<std::uint32_t>(i)
                                                : block.basis.chosen[static_cast<std::size_t>(i)]);
      coefficients.push_back(term.coefficients[first + i]);
      precision.push_back(term.precision[first + i]);
    }
    first += n;
    if (kept.empty()) continue;
    if (kept.size() < static_cast<std::size_t>(n)) block.basis.chosen = kept;
    blocks.push_back(std::move(block));
  }
  if (blocks.empty()) return;
  term.blocks = std::move(blocks);
  term.coefficients =
      Eigen::Map<Eigen::VectorXd>(coefficients.data(), static_cast<Eigen::Index>(coefficients.size()));
  term.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), static_cast<Eigen::Index>(precision.size()));
}

}  // namespace

double Smoothness::sd(double roughness) const {
  return size * std::pow(1 + (roughness / knee) * (roughness / knee), -decay / 2);
}

double log_evidence(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, const Eigen::VectorXd& sd) {
  Eigen::MatrixXd own = sd.asDiagonal() * information * sd.asDiagonal();
  own.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> root(own);
  const Eigen::VectorXd part = root.matrixL().solve(sd.cwiseProduct(score));
  return 0.5 * part.squaredNorm() - root.matrixLLT().diagonal().array().log().sum();
}

double choose_smoothness(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                         const std::vector<ColumnGroup>& groups, std::vector<Smoothness>& smoothness,
                         Eigen::VectorXd& sd) {
  const auto fill = [&](std::size_t g, const Smoothness& by, Eigen::VectorXd& to) {
    for (std::size_t i = 0; i < groups[g].columns.size(); ++i)
      to[groups[g].columns[i]] = by.sd(groups[g].roughness[i]);
  };
  const bool anew = smoothness.size() != groups.size();
  sd = Eigen::VectorXd::Zero(score.size());
  if (anew) smoothness.assign(groups.size(), {0, 4, 2});
  for (std::size_t g = 0; g < groups.size(); ++g) fill(g, smoothness[g], sd);
  double best = log_evidence(information, score, sd);
  const auto try_it = [&](std::size_t g, const Smoothness& trial) {
    Eigen::VectorXd changed = sd;
    fill(g, trial, changed);
    const double value = log_evidence(information, score, changed);
    if (!(value > best + 1e-9)) return false;
    best = value;
    sd = changed;
    smoothness[g] = trial;
    return true;
  };
  for (int sweep = 0; sweep < 3; ++sweep) {
    const double before = best;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (smoothness[g].size == 0) {
        // Starts at the scale that a single column can resolve.
        double smallest = 1e300;
        for (const Eigen::Index c : groups[g].columns)
          if (information(c, c) > 0) smallest = std::min(smallest, 1 / std::sqrt(information(c, c)));
        if (smallest == 1e300) continue;
        double size = smallest;
        while (size < 3000 * smallest) {
          for (const double knee : {1.0, 4.0, 16.0}) try_it(g, {size, knee, 3});
          size *= 4;
        }
      }
      if (smoothness[g].size == 0) continue;
      double factor = 3;
      while (factor > 1.2) {
        bool better = true;
        while (better) {
          const Smoothness was = smoothness[g];
          better = false;
          for (const double by : {factor, 1 / factor}) {
            Smoothness trial = was;
            trial.size *= by;
            better = try_it(g, trial) || better;
            trial = was;
            trial.knee = std::clamp(trial.knee * by, 0.3, 60.0);
            better = try_it(g, trial) || better;
            trial = was;
            trial.decay = std::clamp(trial.decay * by, 0.6, 12.0);
            better = try_it(g, trial) || better;
            // A smaller knee with the same tail.
            trial = was;
            trial.knee = std::clamp(trial.knee * by, 0.3, 60.0);
            trial.size *= std::pow(by, -trial.decay);
            better = try_it(g, trial) || better;
          }
        }
        factor = std::sqrt(factor);
      }
      Smoothness none = smoothness[g];
      none.size = 0;
      try_it(g, none);
    }
    if (best < before + 0.1) break;
  }
  return best;
}

namespace {

/// Uses the `rich` blocks in place of the term's, or the term's own if there are none.
void fit_smoothly(const Fitter& fitter, FitState& state, std::size_t place, const std::vector<Block>& rich,
                  int passes = 5) {
  MotionModel& model = state.model;
  const std::vector<ColumnGroup> groups = groups_of(rich.empty() ? model.terms[place].blocks : rich);
  std::vector<Smoothness> smoothness;
  Eigen::VectorXd sd;
  double likelihood = -1e300;
  for (int pass = 0; pass < passes; ++pass) {
    const bool anew = pass == 0 && !rich.empty();
    const LocalQuadratic l = local_quadratic(fitter, state, place, anew ? rich : std::vector<Block>{});
    Term& term = model.terms[place];
    const Eigen::VectorXd at_zero = l.score_without(term.coefficients);
    const std::vector<Eigen::Index> columns = anew ? l.added_columns() : l.term_columns();
    const ReducedColumns data = reduced_columns(l, at_zero, columns);
    choose_smoothness(data.information, data.score, groups, smoothness, sd);
    // A prior sd near 0 fixes the column at 0.
    const Eigen::VectorXd held = sd.cwiseMax(1e-6 * std::max(sd.maxCoeff(), 1e-6));
    if (anew) {
      replace_blocks(model, place, l, rich, at_zero, columns, held);
    } else {
      term.precision = held.array().square().inverse();
    }
    const double now = fitter.fit_for_likelihood(state, 1);
    const bool last = pass + 1 == passes || now < likelihood + kSettled;
    likelihood = now;
    if (!last) continue;
    prune(term, data.information.diagonal());
    break;
  }
}

}  // namespace

void refine_curves(const Fitter& fitter, FitState& state, std::size_t place) {
  const Term& term = state.model.terms[place];
  if (term.general || is_product(term) || is_switch(term)) return refit(fitter, state, place);
  fit_smoothly(fitter, state, place, richer(term));
}

void refine_to(const Fitter& fitter, FitState& state, std::size_t place, const std::vector<Block>& blocks,
               int passes) {
  fit_smoothly(fitter, state, place, blocks, passes);
}

void refit(const Fitter& fitter, FitState& state, std::size_t place) { fit_smoothly(fitter, state, place, {}); }

}  // namespace kilotwin::identify
