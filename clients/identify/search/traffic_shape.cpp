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
  for (double size = 0.01; size < 6; size *= 2) {
    const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
    const double evidence = log_evidence(information, score, sd);
    if (evidence <= form.evidence) continue;
    form.evidence = evidence;
    form.sd = sd;
  }
}

/// Forward selection of steps while the gain exceeds the choice penalty.
Form some_steps(const ReducedColumns& data, Eigen::Index first, const Block& steps) {
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

}  // namespace

bool refine_traffic_shape(const Fitter& fitter, FitState& state, std::size_t place) {
  MotionModel& model = state.model;
  const Term& term = model.terms[place];
  if (term.blocks.size() != 1 || term.blocks.front().basis.factors.size() != 1 ||
      !term.blocks.front().basis.looks_at(Covariate::kTraffic))
    return false;
  const Block like = term.blocks.front();
  // A free grid slot: none that other terms use.
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    for (const Block& block : model.terms[t].blocks)
      if (t != place && block.basis.looks_at(Covariate::kTraffic)) return false;
  // The term's present grid moves to the last slot. Candidates use the first.
  constexpr std::uint8_t kOwn = kTrafficGrids - 1, kTried = 0;
  const std::uint8_t found = like.basis.factors.front().axis.radius;
  model.cells[kOwn] = model.cells[found];
  model.terms[place].blocks.front().basis.factors.front().axis.radius = kOwn;
  const std::vector<double> scales = {0.5, 1, 2, 4, 8, 16, 32, 64},
                            steps = {0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 50, 64};
  // The right cells improve positions and noise.
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    FitState without = state;
    without.model.terms[place].coefficients.setZero();
    const GridCells cells = fit_grid_cells(fitter, without, model.cells[kOwn], like.during);
    FitState next = state;
    next.model.cells[kTried] = cells;
    next.tracks.update_traffic(next.model);
    const Block smooth = of_form(like, Shape::kExponential, kTried, scales),
                stepping = of_form(like, Shape::kAtLeast, kTried, steps);
    const LocalQuadratic l = local_quadratic(fitter, next, place, {smooth, stepping});
    const Eigen::VectorXd at_zero = l.score_without(next.model.terms[place].coefficients);
    const ReducedColumns data = reduced_columns(l, at_zero, l.added_columns());
    const auto n = static_cast<Eigen::Index>(scales.size());
    Form best;
    std::vector<Eigen::Index> columns;
    for (Eigen::Index c = 0; c < n; ++c) columns.push_back(c);
    evaluate(data, columns, best);
    best.blocks = {smooth};
    Form other = some_steps(data, n, stepping);
    if (other.evidence > best.evidence) best = std::move(other);
    for (Block& block : best.blocks) block.basis.factors.front().axis.radius = kOwn;
    for (Eigen::Index& c : best.columns) c += l.own;
    replace_blocks(next.model, place, l, best.blocks, at_zero, best.columns, best.sd);
    next.model.cells[kOwn] = cells;
    next.model.cells[kTried] = model.cells[kTried];
    next.tracks.update_traffic(next.model);
    state = std::move(next);
    fitter.fit(state, 1);
  }
  refit(fitter, state, place);
  return true;
}

}  // namespace kilotwin::identify
