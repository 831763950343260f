#include "clients/identify/search/standing_circles.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

constexpr std::size_t kMostCircles = 3, kMostPoints = 4000;
/// Positions along an axis, and radii as shares of the larger side of the visited area.
constexpr int kPlacesAcross = 14;
constexpr std::array<double, 6> kDiscRadii = {0.08, 0.14, 0.2, 0.3, 0.42, 0.6};
/// A further circle explains at least this share of the map's variance.
constexpr double kLeastShare = 0.03;
/// Circles have far fewer numbers than the map: the loss of log likelihood that they may have, absolute and as a share of what the
/// map explains. A map with sharp edges follows chance by some percent.
constexpr double kLoss = 10, kLossShare = 0.05;
/// Log of the number of choices for one number of a circle.
constexpr double kPerNumber = 3;

/// The value of a map where a robot was.
struct MapPoint {
  double x_mm, y_mm, value;
};

struct Disc {
  double x_mm, y_mm, radius_mm;
  [[nodiscard]] bool holds(const MapPoint& p) const {
    const double dx = p.x_mm - x_mm, dy = p.y_mm - y_mm;
    return dx * dx + dy * dy < radius_mm * radius_mm;
  }
};

bool is_of_place(const Basis& basis) {
  const auto place = [](const Axis& axis) { return axis.of == Covariate::kX || axis.of == Covariate::kY; };
  return basis.factors.size() == 1 && basis.factors.front().known.empty() && place(basis.factors.front().axis) &&
         (!basis.factors.front().of_two() || place(basis.factors.front().and_axis));
}

/// The target of a map of the speed or of the turn rate; nothing: the term is no such map.
std::optional<Target> target_of_map(const Term& term) {
  const Target target = term.blocks.front().target;
  if (target != Target::kGain && target != Target::kTurn) return std::nullopt;
  for (const Block& block : term.blocks)
    if (block.during != kDriven || (block.target == target && !is_of_place(block.basis))) return std::nullopt;
  return target;
}

/// The map at measured positions, about its mean.
std::vector<MapPoint> points_of(const FitState& state, const Term& term, Target target) {
  std::size_t samples = 0;
  for (const TrackView& view : state.tracks.views()) samples += view.track->samples.size();
  const std::size_t every = samples / kMostPoints + 1;
  std::vector<MapPoint> points;
  std::array<double, kMostColumns> values;
  Situation s;
  std::size_t next = 0;
  double sum = 0;
  for (const TrackView& view : state.tracks.views()) {
    for (const Sample& sample : view.track->samples) {
      if (next++ % every != 0) continue;
      s.x_mm = sample.x_mm;
      s.y_mm = sample.y_mm;
      MapPoint& point = points.emplace_back(MapPoint{s.x_mm, s.y_mm, 0});
      Eigen::Index first = 0;
      for (const Block& block : term.blocks) {
        const auto n = static_cast<Eigen::Index>(block.basis.size());
        if (block.target == target) {
          block.basis.evaluate(s, 0, values.data());
          point.value += term.coefficients.segment(first, n).dot(Eigen::Map<Eigen::VectorXd>(values.data(), n));
        }
        first += n;
      }
      sum += point.value;
    }
  }
  for (MapPoint& point : points) point.value -= sum / static_cast<double>(points.size());
  return points;
}

/// Inside less outside, and the variance that this explains, times the number of points.
struct Contrast {
  double value = 0, explained = 0;
};

/// The values of `points` sum to 0.
Contrast contrast_of(const std::vector<MapPoint>& points, const Disc& disc) {
  double sum = 0, inside = 0;
  for (const MapPoint& point : points) {
    const double in = disc.holds(point) ? 1 : 0;
    sum += in * point.value;
    inside += in;
  }
  const double all = static_cast<double>(points.size());
  constexpr double kLeast = 0.005;
  if (inside < kLeast * all || inside > (1 - kLeast) * all) return {};
  const double outside = all - inside, value = sum / inside + sum / outside;
  return {value, value * value * inside * outside / all};
}

/// The disc that explains most.
Disc best_disc(const std::vector<MapPoint>& points, const Extent& e) {
  const double side = std::max(e.x_high_mm - e.x_low_mm, e.y_high_mm - e.y_low_mm);
  Disc best{};
  double most = -1;
  const auto better = [&](const Disc& disc) {
    const double explained = contrast_of(points, disc).explained;
    if (explained <= most) return false;
    most = explained;
    best = disc;
    return true;
  };
  for (int j = 0; j < kPlacesAcross; ++j)
    for (int i = 0; i < kPlacesAcross; ++i)
      for (const double radius : kDiscRadii)
        better({e.x_low_mm + (i + 0.5) / kPlacesAcross * (e.x_high_mm - e.x_low_mm),
                e.y_low_mm + (j + 0.5) / kPlacesAcross * (e.y_high_mm - e.y_low_mm), radius * side});
  for (double length = side / kPlacesAcross; length > side / 400; length /= 2) {
    for (bool moved = true; moved;) {
      moved = false;
      for (double Disc::*const number : {&Disc::x_mm, &Disc::y_mm, &Disc::radius_mm}) {
        for (const double by : {length, -length}) {
          Disc trial = best;
          trial.*number += by;
          moved = better(trial) || moved;
        }
      }
    }
  }
  return best;
}

/// Discs one after the other, each for what the earlier ones leave.
std::vector<Disc> discs_of(std::vector<MapPoint> points, const Extent& extent) {
  const auto variance = [&] {
    double sum = 0;
    for (const MapPoint& point : points) sum += point.value * point.value;
    return sum;
  };
  const double all = variance();
  std::vector<Disc> discs;
  while (discs.size() < kMostCircles) {
    const Disc disc = best_disc(points, extent);
    const Contrast contrast = contrast_of(points, disc);
    if (!(contrast.explained > kLeastShare * all)) break;
    discs.push_back(disc);
    double sum = 0;
    for (MapPoint& point : points) {
      if (disc.holds(point)) point.value -= contrast.value;
      sum += point.value;
    }
    for (MapPoint& point : points) point.value -= sum / static_cast<double>(points.size());
  }
  return discs;
}

Factor& curve_of(Block& block) { return block.basis.factors.front(); }

/// Moves the centres of all circles by Gauss-Newton steps. Returns whether the likelihood rose.
bool move_centres(const Fitter& fitter, FitState& state, std::size_t place) {
  constexpr int kMostMoves = 5;
  constexpr double kLeastRise = 1, kLargestStep_mm = 40;
  double likelihood = fitter.log_likelihood(state);
  bool moved = false;
  for (int pass = 0; pass < kMostMoves; ++pass) {
    std::vector<Block> slopes;
    for (std::size_t b = 0; b < state.model.terms[place].blocks.size(); ++b) {
      slopes.push_back(derivatives_of(state.model.terms[place], b, 1));
      // The centre's place alone: the circle stands still.
      slopes.back().basis.chosen = {0, 1};
    }
    const LocalQuadratic l = local_quadratic(fitter, state, state.model.terms.size(), slopes, true);
    const auto n = static_cast<Eigen::Index>(2 * slopes.size());
    Eigen::MatrixXd information = l.information;
    information.diagonal().head(l.prior.size()) += l.prior;
    information.diagonal().tail(n).array() += 1 / (kLargestStep_mm * kLargestStep_mm);
    const Eigen::VectorXd step = information.ldlt().solve(l.score).tail(n);
    bool better = false;
    for (const double length : {1.0, 0.4, 0.16}) {
      FitState trial = state;
      for (std::size_t b = 0; b < slopes.size(); ++b) {
        MovingPoint& point = curve_of(trial.model.terms[place].blocks[b]).axis.point;
        point.x_mm += length * step[static_cast<Eigen::Index>(2 * b)];
        point.y_mm += length * step[static_cast<Eigen::Index>(2 * b + 1)];
      }
      fitter.fit(trial, 2);
      const double found = fitter.log_likelihood(trial);
      // Negated, so that a likelihood that is no number is no progress.
      if (!(found > likelihood + kLeastRise)) continue;
      likelihood = found;
      state = std::move(trial);
      better = moved = true;
      break;
    }
    if (!better) break;
  }
  return moved;
}

/// The term with a curve about the centre of each disc.
FitState with_curves(const Fitter& fitter, const FitState& state, std::size_t place, Target target,
                     const std::vector<Disc>& discs) {
  constexpr std::uint32_t kColumns = 16;
  std::vector<Block> blocks;
  for (const Disc& disc : discs)
    blocks.push_back({target, Basis{{curve_about(state, {disc.x_mm, disc.y_mm}, kColumns)}}, kDriven});
  FitState trial = state;
  refine_to(fitter, trial, place, blocks);
  // Its columns are one set from here on.
  if (move_centres(fitter, trial, place)) refine_curves(fitter, trial, place);
  if (move_centres(fitter, trial, place)) refit(fitter, trial, place);
  return trial;
}

/// Fits until the likelihood settles: the base speeds move far when a curve becomes a step.
void settle(const Fitter& fitter, FitState& state) {
  constexpr int kMostFits = 6;
  double before = -1e300;
  for (int i = 0; i < kMostFits; ++i) {
    fitter.fit(state, 2);
    const double now = fitter.log_likelihood(state);
    if (!(now > before + 1)) return;
    before = now;
  }
}

/// Candidate radii of the blocks, columns of the quadratic approximation.
struct EdgeRaster {
  std::vector<std::vector<double>> at_mm;  ///< [block][candidate]
  std::vector<Block> blocks;               ///< all candidates
};

EdgeRaster raster_about(const Term& term, const std::vector<double>& middle_mm, double half_mm) {
  constexpr int kHalf = 12;
  EdgeRaster out;
  for (std::size_t b = 0; b < term.blocks.size(); ++b) {
    Block block = term.blocks[b];
    Factor& edge = curve_of(block);
    edge.shape = Shape::kAtLeast;
    edge.points.clear();
    for (int i = -kHalf; i <= kHalf; ++i) {
      const double at_mm = middle_mm[b] + half_mm * i / kHalf;
      if (at_mm > edge.low && at_mm < edge.high) edge.points.push_back(at_mm);
    }
    block.basis.chosen.clear();
    out.at_mm.push_back(edge.points);
    out.blocks.push_back(block);
  }
  return out;
}

/// A radius per block, as the index of its candidate, and the prior standard deviation of the steps.
struct Edges {
  std::vector<std::size_t> chosen;
  double sd = 0;
};

/// The combination of radii with the most evidence, changed one at a time.
Edges best_edges(const ReducedColumns& data, const EdgeRaster& raster) {
  Edges best;
  for (const auto& at : raster.at_mm) best.chosen.push_back(at.size() / 2);
  const auto evidence = [&](const Edges& edges) {
    std::vector<Eigen::Index> columns;
    Eigen::Index first = 0;
    for (std::size_t b = 0; b < edges.chosen.size(); ++b) {
      columns.push_back(first + static_cast<Eigen::Index>(edges.chosen[b]));
      first += static_cast<Eigen::Index>(raster.at_mm[b].size());
    }
    const auto n = static_cast<Eigen::Index>(columns.size());
    return log_evidence(data.information(columns, columns), data.score(columns),
                        Eigen::VectorXd::Constant(n, edges.sd));
  };
  const double smallest = 1 / std::sqrt(std::max(data.information.diagonal().maxCoeff(), 1e-12));
  best.sd = 30 * smallest;
  double most = evidence(best);
  const auto better = [&](const Edges& trial) {
    const double value = evidence(trial);
    if (!(value > most + 1e-9)) return false;
    most = value;
    best = trial;
    return true;
  };
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t b = 0; b < best.chosen.size(); ++b) {
      for (std::size_t i = 0; i < raster.at_mm[b].size(); ++i) {
        Edges trial = best;
        trial.chosen[b] = i;
        moved = better(trial) || moved;
      }
    }
    for (double sd = smallest; sd < 10'000 * smallest; sd *= 3) {
      Edges trial = best;
      trial.sd = sd;
      moved = better(trial) || moved;
    }
  }
  return best;
}

/// The term with one step per circle; nothing if a circle has no room for one.
std::optional<FitState> with_edges(const Fitter& fitter, FitState state, std::size_t place,
                                   const std::vector<Disc>& discs) {
  std::vector<double> middle_mm;
  for (const Block& block : state.model.terms[place].blocks) {
    const MovingPoint& point = block.basis.factors.front().axis.point;
    const auto nearest = std::min_element(discs.begin(), discs.end(), [&](const Disc& a, const Disc& b) {
      return std::hypot(a.x_mm - point.x_mm, a.y_mm - point.y_mm) <
             std::hypot(b.x_mm - point.x_mm, b.y_mm - point.y_mm);
    });
    middle_mm.push_back(nearest->radius_mm);
  }
  for (double half_mm = 60; half_mm > 2; half_mm /= 5) {
    const EdgeRaster raster = raster_about(state.model.terms[place], middle_mm, half_mm);
    if (std::any_of(raster.at_mm.begin(), raster.at_mm.end(), [](const auto& at) { return at.empty(); }))
      return std::nullopt;
    const LocalQuadratic l = local_quadratic(fitter, state, place, raster.blocks);
    const Eigen::VectorXd score = l.score_without(state.model.terms[place].coefficients);
    const Edges best = best_edges(reduced_columns(l, score, l.added_columns()), raster);
    std::vector<Block> blocks = raster.blocks;
    std::vector<Eigen::Index> columns;
    Eigen::Index first = l.own;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      middle_mm[b] = raster.at_mm[b][best.chosen[b]];
      curve_of(blocks[b]).points = {middle_mm[b]};
      columns.push_back(first + static_cast<Eigen::Index>(best.chosen[b]));
      first += static_cast<Eigen::Index>(raster.at_mm[b].size());
    }
    replace_blocks(state.model, place, l, blocks, score, columns,
                   Eigen::VectorXd::Constant(static_cast<Eigen::Index>(blocks.size()), best.sd));
    settle(fitter, state);
  }
  return state;
}

/// Returns whether circles replaced the map.
bool replace_by_circles(const Fitter& fitter, FitState& state, std::size_t place) {
  const Term& term = state.model.terms[place];
  const std::optional<Target> target = target_of_map(term);
  if (!target) return false;
  const std::vector<Disc> discs = discs_of(points_of(state, term, *target), extent_of(state.tracks));
  if (discs.empty()) return false;
  FitState without = state;
  without.model.terms.erase(without.model.terms.begin() + static_cast<std::ptrdiff_t>(place));
  fitter.fit(without, 1);
  const double had = fitter.log_likelihood(state),
               least = had - kLoss - kLossShare * (had - fitter.log_likelihood(without));
  std::optional<FitState> best;
  double most = 0;
  for (std::size_t n = 1; n <= discs.size(); ++n) {
    const std::vector<Disc> some(discs.begin(), discs.begin() + static_cast<std::ptrdiff_t>(n));
    FitState trial = with_curves(fitter, state, place, *target, some);
    const double numbers = kPerNumber * 3 * static_cast<double>(n);
    double value = fitter.log_evidence(trial) - numbers;
    if (std::optional<FitState> edges = with_edges(fitter, trial, place, some)) {
      const double sharp = fitter.log_evidence(*edges) - numbers;
      if (sharp > value) {
        trial = std::move(*edges);
        value = sharp;
      }
    }
    if (!(fitter.log_likelihood(trial) > least) || (best && !(value > most))) continue;
    most = value;
    best = std::move(trial);
  }
  if (!best) return false;
  state = std::move(*best);
  return true;
}

}  // namespace

void replace_maps_by_circles(const Fitter& fitter, Search& found) {
  Stage before{found.fit, found.reasons};
  bool replaced = false;
  for (std::size_t t = 0; t < found.fit.model.terms.size(); ++t)
    replaced = replace_by_circles(fitter, found.fit, t) || replaced;
  if (replaced) found.with_maps = std::move(before);
}

}  // namespace kilotwin::identify
