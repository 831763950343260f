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

/// What a size of cells makes of the data.
struct Weighed {
  double cell_mm = 0, evidence = -1e300, sd = 1;
};

/// How far robots came from the middle of the room, where cells of all sizes begin.
double extent_mm(const PreparedSet& set) {
  std::vector<double> away;
  for (const TrackView& view : set.views())
    for (const Sample& s : view.track->samples) away.push_back(std::max(std::abs(s.x_mm), std::abs(s.y_mm)));
  const auto most = away.begin() + static_cast<std::ptrdiff_t>(away.size() - 1 - away.size() / 50);
  std::nth_element(away.begin(), most, away.end());
  return *most;
}

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
  const std::vector<double> points = {1, 3, 9, 27, 81};
  const auto n = static_cast<Eigen::Index>(points.size());
  // Cells a little too large lie elsewhere far from the middle: sizes are tried as close as that asks for.
  double cell_mm = model.cells_mm[found];
  double apart = std::clamp(0.5 * cell_mm / extent_mm(fitter.set()), 0.012, 0.08);
  constexpr double kOff = 0.28;  // relative, how far the first guess may be
  int batches = static_cast<int>(std::ceil(2 * kOff / apart / static_cast<double>(kFloorCells)));
  // What the term looks at now stays: it is put into a cell size of its own, which is the last.
  constexpr std::uint8_t kOwn = kFloorCells - 1;
  model.terms[place].blocks.front().basis.factors.front().axis.radius = kOwn;
  model.cells_mm[kOwn] = cell_mm;
  for (; apart > 0.002; apart /= 4, batches = 1) {
    Weighed best;
    std::vector<double> sizes;
    const int count = batches * static_cast<int>(kOwn);
    for (int i = 0; i < count; ++i) sizes.push_back(cell_mm * std::pow(1 + apart, i - count / 2));
    for (int batch = 0; batch < batches; ++batch) {
      MotionModel trial = model;
      std::vector<Block> blocks;
      for (std::uint8_t c = 0; c < kOwn; ++c) {
        trial.cells_mm[c] = sizes[static_cast<std::size_t>(batch) * kOwn + c];
        blocks.push_back(curve_of(like, c, points));
      }
      fitter.set().remember(trial);
      const Linear l = linear(fitter, trial, place, blocks);
      const Beside data = beside(l, l.score_without(trial.terms[place].coefficients), l.more());
      for (std::uint8_t c = 0; c < kOwn; ++c) {
        const Eigen::MatrixXd information = data.information.block(c * n, c * n, n, n);
        const Eigen::VectorXd score = data.score.segment(c * n, n);
        for (double sd = 0.01; sd < 6; sd *= 2) {
          const double evidence = log_evidence(information, score, Eigen::VectorXd::Constant(n, sd));
          if (evidence > best.evidence) best = {trial.cells_mm[c], evidence, sd};
        }
      }
    }
    // The best takes the term's place.
    cell_mm = best.cell_mm;
    MotionModel next = model;
    next.cells_mm[0] = cell_mm;
    fitter.set().remember(next);
    const Linear l = linear(fitter, next, place, {curve_of(like, 0, points)});
    const Eigen::VectorXd at_zero = l.score_without(next.terms[place].coefficients);
    exchange(next, place, l, {curve_of(like, kOwn, points)}, at_zero, l.more(),
             Eigen::VectorXd::Constant(n, best.sd));
    next.cells_mm[kOwn] = cell_mm;
    model = next;
    fitter.set().remember(model);
    fitter.fit(model, 1);
  }
  settle(fitter, model, place);
  return true;
}

}  // namespace kilotwin::identify
