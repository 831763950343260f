#include "clients/identify/search/circle_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

MovingPoint& point_of(Term& term) { return term.blocks.front().basis.factors.front().axis.point; }

/// Whether all blocks are curves about the same centre, which moves or grows.
bool is_curve_that_moves(const Term& term) {
  if (!is_moving_circle(term)) return false;
  const MovingPoint& point = term.blocks.front().basis.factors.front().axis.point;
  return !point.stands() && std::all_of(term.blocks.begin(), term.blocks.end(), [&](const Block& block) {
    return block.basis.factors.size() == 1 && block.basis.factors.front().axis.of == Covariate::kPointDistance &&
           block.basis.factors.front().axis.point == point;
  });
}

/// The distance at which one step explains most of the curve of a term's first block, where robots were; mm.
double edge_of_curve(const FitState& state, const Term& term) {
  // Samples that judge the edge, at most about; more cost time, fewer place it less exactly.
  constexpr std::size_t kEnough = 4000;
  std::size_t samples = 0;
  for (const TrackView& view : state.tracks.views()) samples += view.track->samples.size();
  const std::size_t every = samples / kEnough + 1;
  const Basis& basis = term.blocks.front().basis;
  std::vector<std::pair<double, double>> curve;  // distance, value
  std::array<double, kMostColumns> values;
  std::size_t next = 0;
  double sum = 0;
  for (const TrackView& view : state.tracks.views()) {
    Situation s;
    for (const Sample& sample : view.track->samples) {
      if (next++ % every != 0) continue;
      s.time_s = sample.time_s;
      s.x_mm = sample.x_mm;
      s.y_mm = sample.y_mm;
      basis.evaluate(s, 0, values.data());
      double value = 0;
      for (std::size_t i = 0; i < basis.size(); ++i)
        value += term.coefficients[static_cast<Eigen::Index>(i)] * values[i];
      curve.emplace_back(value_of(basis.factors.front().axis, s, 0), value);
      sum += value;
    }
  }
  std::sort(curve.begin(), curve.end());
  const double mean = sum / static_cast<double>(curve.size()), all = static_cast<double>(curve.size());
  double inside = 0, most = -1, edge_mm = curve.front().first;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    inside += curve[i].second - mean;
    const double n = static_cast<double>(i + 1), explained = inside * inside * (1 / n + 1 / (all - n));
    if (!(explained > most)) continue;
    most = explained;
    edge_mm = (curve[i].first + curve[i + 1].first) / 2;
  }
  return edge_mm;
}

/// Moves of centre and radius at the start and at the end of a run, and of both together. A circle that stands gets no motion.
std::vector<MoveNumber> moves_of(const MovingPoint& point, double duration_s) {
  struct Part {
    double MovingPoint::*at_start;
    double MovingPoint::*per_s;
  };
  std::vector<MoveNumber> moves;
  const auto every_point = [](const auto& change) {
    return [change](Term& term, double by_mm) {
      for (Block& block : term.blocks) change(block.basis.factors.front(), by_mm);
    };
  };
  const bool moves_on = point.velocity_x_mm_s != 0 || point.velocity_y_mm_s != 0;
  for (const Part part : {Part{&MovingPoint::x_mm, &MovingPoint::velocity_x_mm_s},
                          Part{&MovingPoint::y_mm, &MovingPoint::velocity_y_mm_s}}) {
    moves.push_back(every_point([part](Factor& f, double by_mm) { f.axis.point.*part.at_start += by_mm; }));
    if (!moves_on) continue;
    moves.push_back(every_point(
        [part, duration_s](Factor& f, double by_mm) { f.axis.point.*part.per_s += by_mm / duration_s; }));
    moves.push_back(every_point([part, duration_s](Factor& f, double by_mm) {
      f.axis.point.*part.at_start += by_mm;
      f.axis.point.*part.per_s -= by_mm / duration_s;
    }));
  }
  moves.push_back(every_point([](Factor& f, double by_mm) { f.points.front() += by_mm; }));
  if (point.growth_mm_s == 0) return moves;
  moves.push_back(
      every_point([duration_s](Factor& f, double by_mm) { f.axis.point.growth_mm_s += by_mm / duration_s; }));
  moves.push_back(every_point([duration_s](Factor& f, double by_mm) {
    f.points.front() += by_mm;
    f.axis.point.growth_mm_s -= by_mm / duration_s;
  }));
  return moves;
}

}  // namespace

double cost_of_circle(const Term& term) {
  // Two of its centre, two of a velocity, one of a growth, one of an edge.
  const Factor& f = term.blocks.front().basis.factors.front();
  const MovingPoint& p = f.axis.point;
  return kCircleNumber * (2.0 + (p.velocity_x_mm_s != 0 || p.velocity_y_mm_s != 0 ? 2 : 0) +
                          (p.growth_mm_s != 0 ? 1 : 0) + (f.shape == Shape::kAtLeast ? 1 : 0));
}

void settle(const Fitter& fitter, FitState& state) {
  // Fits of two passes; the loop ends earlier once the log likelihood rises by less than 1.
  constexpr int kMostFits = 6;
  double before = -1e300;
  for (int i = 0; i < kMostFits; ++i) {
    const double now = fitter.fit_for_likelihood(state, 2);
    if (!(now > before + 1)) return;
    before = now;
  }
}

void climb(const Fitter& fitter, FitState& state, std::size_t place, double first_mm,
           const std::vector<MoveNumber>& moves, std::uint64_t most_work) {
  // Smallest move; a smaller one costs a fit per number and places edges below the tracker's noise.
  constexpr double kLast_mm = 0.7;
  double likelihood = fitter.log_likelihood(state);
  const auto moved = [&](const MoveNumber& move, double by_mm) {
    FitState trial = state;
    move(trial.model.terms[place], by_mm);
    // A fit has settled before each move: a small move that pays does so with the other numbers held, too, at a fraction of the cost.
    // Negated, so that a likelihood that is no number is no progress.
    if (!(fitter.log_likelihood(trial) > likelihood)) return false;
    const double found = fitter.fit_for_likelihood(trial, 2);
    if (!(found > likelihood)) return false;
    likelihood = found;
    state = std::move(trial);
    return true;
  };
  // Moves of one size in one direction. Held numbers make steps shorter, so that one may not do.
  constexpr int kMost = 3;
  const auto moved_on = [&](const MoveNumber& move, double by_mm) {
    int steps = 0;
    while (steps < kMost && state.tracks.work() < most_work && moved(move, by_mm)) ++steps;
    return steps > 0;
  };
  double step_mm = first_mm;
  while (step_mm > kLast_mm) {
    for (const MoveNumber& move : moves)
      if (!moved_on(move, step_mm)) moved_on(move, -step_mm);
    step_mm /= 2;
  }
}

void put_edges(const Fitter& fitter, FitState& state, std::size_t place, const std::vector<double>& radii_mm) {
  Term& term = state.model.terms[place];
  const auto circles = static_cast<Eigen::Index>(term.blocks.size());
  for (Eigen::Index b = 0; b < circles; ++b) {
    Block& block = term.blocks[static_cast<std::size_t>(b)];
    // The columns that are left of the curve.
    block.basis.chosen.clear();
    Factor& edge = block.basis.factors.front();
    edge.shape = Shape::kAtLeast;
    edge.points = {radii_mm[static_cast<std::size_t>(b)]};
  }
  term.coefficients = Eigen::VectorXd::Zero(circles);
  term.precision = Eigen::VectorXd::Constant(circles, 1 / (kCircleSd * kCircleSd));
  settle(fitter, state);
}

bool sharpen_moving_circles(const Fitter& fitter, Search& found, std::uint64_t most_work) {
  // First move of a number; a larger one leaves a wrong place farther off, a smaller one needs more fits.
  constexpr double kFirst_mm = 24;
  bool sharpened = false;
  for (std::size_t t = 0; t < found.fit.model.terms.size(); ++t) {
    if (!is_curve_that_moves(found.fit.model.terms[t]) || found.fit.tracks.work() >= most_work) continue;
    const double duration_s = extent_of(found.fit.tracks).duration_s;
    FitState edges = found.fit;
    const double radius_mm = edge_of_curve(edges, edges.model.terms[t]);
    put_edges(fitter, edges, t, std::vector<double>(edges.model.terms[t].blocks.size(), radius_mm));
    std::optional<FitState> best;
    double most = fitter.log_evidence(found.fit) - cost_of_circle(found.fit.model.terms[t]);
    const auto try_it = [&](FitState trial) {
      climb(fitter, trial, t, kFirst_mm, moves_of(point_of(trial.model.terms[t]), duration_s), most_work);
      refit(fitter, trial, t);
      const double value = fitter.log_evidence(trial) - cost_of_circle(trial.model.terms[t]);
      // Negated, so that a likelihood that is no number is not better.
      if (!(value > most)) return;
      most = value;
      best = std::move(trial);
    };
    try_it(edges);
    if (!best) continue;
    for (const auto& [still, constant] : {std::pair{true, false}, std::pair{false, true}}) {
      FitState trial = *best;
      const MovingPoint at = point_of(trial.model.terms[t]);
      for (Block& block : trial.model.terms[t].blocks) {
        MovingPoint& point = block.basis.factors.front().axis.point;
        if (still) {
          // Where it is halfway through the run.
          point.x_mm = at.x_mm_at(duration_s / 2);
          point.y_mm = at.y_mm_at(duration_s / 2);
          point.velocity_x_mm_s = point.velocity_y_mm_s = 0;
        }
        if (constant) {
          block.basis.factors.front().points.front() += at.growth_mm_s * duration_s / 2;
          point.growth_mm_s = 0;
        }
      }
      const MovingPoint& now = point_of(trial.model.terms[t]);
      if (!(now == at) && !now.stands()) try_it(std::move(trial));
    }
    found.fit = std::move(*best);
    sharpened = true;
  }
  return sharpened;
}

}  // namespace kilotwin::identify
