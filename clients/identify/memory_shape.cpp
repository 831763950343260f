#include "clients/identify/memory_shape.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/linear.hpp"
#include "clients/identify/refine.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

Block curve_of(const Block& like, std::uint8_t cells, std::vector<double> points) {
  Factor f;
  f.shape = Shape::kExponential;
  f.axis = {Covariate::kTrodden, cells};
  f.points = std::move(points);
  return {like.target, Basis{{f}}, like.during};
}

/// Log evidence of each block in place of the term, and the standard deviation beforehand at which it is that.
struct Weighed {
  double evidence = -1e300, sd = 1;
};

}  // namespace

bool shape_memory(const Fitter& fitter, MotionModel& model, std::size_t place) {
  const Term& term = model.terms[place];
  if (term.blocks.size() != 1 || term.blocks.front().basis.factors.size() != 1 ||
      !term.blocks.front().basis.looks_at(Covariate::kTrodden))
    return false;
  const Block like = term.blocks.front();
  const std::uint8_t found = like.basis.factors.front().axis.radius;
  // Cells of the other sizes are free to be tried, but for those that other terms look at.
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    for (const Block& block : model.terms[t].blocks)
      if (t != place && block.basis.looks_at(Covariate::kTrodden)) return false;
  double cell_mm = model.cells_mm[found];
  const std::vector<double> points = {1, 3, 9, 27, 81};
  for (const double ratio : {1.12, 1.04, 1.012, 1.004}) {
    MotionModel trial = model;
    std::vector<Block> blocks;
    for (std::uint8_t c = 0; c < kFloorCells; ++c) {
      trial.cells_mm[c] = cell_mm * std::pow(ratio, static_cast<double>(c) - 3);
      blocks.push_back(curve_of(like, c, points));
    }
    // What the term looks at now stays where it was: the middle of the sizes is that of the last round.
    trial.terms[place].blocks.front().basis.factors.front().axis.radius = 3;
    fitter.set().remember(trial);
    const Linear l = linear(fitter, trial, place, blocks);
    const Eigen::VectorXd at_zero = l.score_without(trial.terms[place].coefficients);
    const Beside data = beside(l, at_zero, l.more());
    std::array<Weighed, kFloorCells> weighed;
    std::size_t best = 0;
    const auto n = static_cast<Eigen::Index>(points.size());
    for (std::size_t c = 0; c < kFloorCells; ++c) {
      const Eigen::Index first = static_cast<Eigen::Index>(c) * n;
      const Eigen::MatrixXd information = data.information.block(first, first, n, n);
      const Eigen::VectorXd score = data.score.segment(first, n);
      for (double sd = 0.01; sd < 6; sd *= 2) {
        const double evidence = log_evidence(information, score, Eigen::VectorXd::Constant(n, sd));
        if (evidence > weighed[c].evidence) weighed[c] = {evidence, sd};
      }
      if (weighed[c].evidence > weighed[best].evidence) best = c;
    }
    std::vector<Eigen::Index> columns;
    for (Eigen::Index i = 0; i < n; ++i) columns.push_back(l.own + static_cast<Eigen::Index>(best) * n + i);
    exchange(trial, place, l, {curve_of(like, 3, points)}, at_zero, columns,
             Eigen::VectorXd::Constant(n, weighed[best].sd));
    cell_mm = trial.cells_mm[best];
    trial.cells_mm[3] = cell_mm;
    model = trial;
    fitter.set().remember(model);
    fitter.fit(model, 1);
  }
  settle(fitter, model, place);
  return true;
}

}  // namespace kilotwin::identify
