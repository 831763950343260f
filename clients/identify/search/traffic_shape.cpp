#include "clients/identify/search/traffic_shape.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/traffic_cells.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

Block curve_of(const Block& like, std::uint8_t cells, std::vector<double> points) {
  Factor f;
  f.shape = Shape::kExponential;
  f.axis = {Covariate::kTraffic, cells};
  f.points = std::move(points);
  return {like.target, Basis{{f}}, like.during};
}

/// Candidate forms over the driven time per cell: smooth curves, and steps of which some are selected.
struct Form {
  std::vector<Block> blocks;
  std::vector<Eigen::Index> columns;  ///< of those that were evaluated
  Eigen::VectorXd sd;
  double evidence = -1e300;
};

/// Evidence at the best common prior standard deviation.
void evaluate(const ReducedColumns& data, const std::vector<Eigen::Index>& columns, Form& form) {
  const Eigen::MatrixXd information = data.information(columns, columns);
  const Eigen::VectorXd score = data.score(columns);
  form.columns = columns;
  form.evidence = -1e300;
  double size = 0.01;
  while (size < 6) {
    const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
    const double evidence = log_evidence(information, score, sd);
    if (!(evidence <= form.evidence)) {
      form.evidence = evidence;
      form.sd = sd;
    }
    size *= 2;
  }
}

/// Forward selection of steps while the gain exceeds the choice penalty.
Form some_steps(const ReducedColumns& data, Eigen::Index first, const Block& steps) {
  // Steps of the curve over traffic; more imitate a smooth curve by many steps.
  constexpr std::size_t kMostSteps = 5;
  const std::vector<double>& points = steps.basis.factors.front().points;
  const double price = std::log(static_cast<double>(points.size()));
  Form best;
  std::vector<std::size_t> chosen;
  while (chosen.size() < kMostSteps) {
    Form next;
    std::size_t added = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
      if (std::find(chosen.begin(), chosen.end(), p) != chosen.end()) continue;
      std::vector<Eigen::Index> columns;
      columns.reserve(chosen.size() + 1);
      for (const std::size_t c : chosen) columns.push_back(first + static_cast<Eigen::Index>(c));
      columns.push_back(first + static_cast<Eigen::Index>(p));
      Form trial;
      evaluate(data, columns, trial);
      trial.evidence -= price * static_cast<double>(columns.size());
      if (trial.evidence <= next.evidence) continue;
      next = trial;
      added = p;
    }
    if (next.evidence <= std::max(best.evidence, 0.0)) break;
    best = next;
    chosen.push_back(added);
  }
  std::sort(chosen.begin(), chosen.end());
  Block block = steps;
  std::vector<double>& own = block.basis.factors.front().points;
  own.clear();
  best.columns.clear();
  for (const std::size_t c : chosen) {
    own.push_back(points[c]);
    best.columns.push_back(first + static_cast<Eigen::Index>(c));
  }
  best.blocks = {block};
  return best;
}

Block of_form(const Block& like, Shape shape, std::uint8_t cells, std::vector<double> points) {
  Block block = curve_of(like, cells, std::move(points));
  block.basis.factors.front().shape = shape;
  return block;
}

/// Scales of smooth curves and positions of steps.
struct Points {
  Shape smooth;
  std::vector<double> scales, steps;
};
Points points_of(const GridCells& cells) {
  if (cells.trail)
    return {Shape::kLevelling,
            {0.03, 0.06, 0.12, 0.25, 0.5, 1, 2},
            {0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}};
  return {Shape::kExponential,
          {0.5, 1, 2, 4, 8, 16, 32, 64},
          {0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 50, 64}};
}

/// A term of traffic, with the cells of one kind at the best evidence.
struct Refined {
  FitState state;
  double evidence = -1e300;
};

/// The grid of a term of traffic: the last one of its kind. Candidates use the first of all.
constexpr std::uint8_t kTried = 0;
std::uint8_t own_grid(const GridCells& cells) {
  return static_cast<std::uint8_t>((cells.trail ? kTrafficGrids : kFirstTrailGrid) - 1);
}

/// `from`: the kind of the cells, and where their search starts.
Refined refined(const Fitter& fitter, const FitState& state, std::size_t place, const GridCells& from) {
  const std::uint8_t own = own_grid(from);
  const MotionModel& model = state.model;
  const Block like = model.terms[place].blocks.front();
  FitState without = state;
  without.model.terms[place].coefficients.setZero();
  const GridCells cells = fit_grid_cells(fitter, without, from, like.during);
  Refined out{state};
  FitState& next = out.state;
  next.model.cells[kTried] = cells;
  next.tracks.update_traffic(next.model);
  const Points points = points_of(cells);
  const Block smooth = of_form(like, points.smooth, kTried, points.scales),
              stepping = of_form(like, Shape::kAtLeast, kTried, points.steps);
  const LocalQuadratic l = local_quadratic(fitter, next, place, {smooth, stepping});
  const Eigen::VectorXd at_zero = l.score_without(next.model.terms[place].coefficients);
  const ReducedColumns data = reduced_columns(l, at_zero, l.added_columns());
  const auto n = static_cast<Eigen::Index>(points.scales.size());
  Form best;
  std::vector<Eigen::Index> columns;
  for (Eigen::Index c = 0; c < n; ++c) columns.push_back(c);
  evaluate(data, columns, best);
  best.blocks = {smooth};
  Form other = some_steps(data, n, stepping);
  if (other.evidence > best.evidence) best = std::move(other);
  out.evidence = best.evidence;
  for (Block& block : best.blocks) block.basis.factors.front().axis.radius = own;
  for (Eigen::Index& c : best.columns) c += l.own;
  replace_blocks(next.model, place, l, best.blocks, at_zero, best.columns, best.sd);
  next.model.cells[own] = cells;
  next.model.cells[kTried] = model.cells[kTried];
  next.tracks.update_traffic(next.model);
  return out;
}

}  // namespace

bool refine_traffic_shape(const Fitter& fitter, FitState& state, std::size_t place) {
  MotionModel& model = state.model;
  const Term& term = model.terms[place];
  if (term.blocks.size() != 1 || term.blocks.front().basis.factors.size() != 1 ||
      !term.blocks.front().basis.looks_at(Covariate::kTraffic))
    return false;
  // One term of traffic only: the grids of others are free.
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    for (const Block& block : model.terms[t].blocks)
      if (t != place && block.basis.looks_at(Covariate::kTraffic)) return false;
  std::uint8_t& grid = model.terms[place].blocks.front().basis.factors.front().axis.radius;
  const GridCells found = model.cells[grid];
  grid = own_grid(found);
  model.cells[grid] = found;
  state.tracks.update_traffic(model);
  // Time in a cell and trails of others look alike from far: both kinds are refined, and the evidence chooses.
  constexpr double kForget_s = 10;
  GridCells other = found;
  other.trail = !other.trail;
  if (other.forget_s == 0) other.forget_s = kForget_s;
  Refined best = refined(fitter, state, place, found);
  if (Refined of_other = refined(fitter, state, place, other); of_other.evidence > best.evidence)
    best = std::move(of_other);
  state = std::move(best.state);
  fitter.fit(state, 1);
  // The right cells improve positions and noise.
  const GridCells chosen = model.cells[model.terms[place].blocks.front().basis.factors.front().axis.radius];
  state = refined(fitter, state, place, chosen).state;
  fitter.fit(state, 1);
  refit(fitter, state, place);
  return true;
}

}  // namespace kilotwin::identify
