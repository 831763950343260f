#include "clients/identify/search/standing_circles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/search/circle_edges.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/number_steps.hpp"
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
/// The share of the map's gain that n circles have to reach over n, or no further one is tried; and that of their curves, or no edges
/// are tried.
constexpr double kLeastOfEach = 0.25, kLeastCurves = 0.15;
/// Share of the variance of the circles' curves that one step in each has to explain, or no edges are tried. Measured in scenes with
/// patches: 0.84 to 0.92; of a smooth peak 0.72.
constexpr double kLeastSteps = 0.78;
/// Work that circles may cost: a share of that of the search, between these bounds. Beyond, the map stays unless circles so far are
/// better. In a small set, two patches cost 1.3 times their search; the lower bound is enough for that.
constexpr double kShareOfWork = 0.8, kLeastWork = 5e7, kMostOfWork = 1.5e8;

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

void subtract_mean(std::vector<MapPoint>& points) {
  double sum = 0;
  for (const MapPoint& point : points) sum += point.value;
  for (MapPoint& point : points) point.value -= sum / static_cast<double>(points.size());
}

/// Measured positions, with value 0.
std::vector<MapPoint> positions_of(const PreparedSet& tracks) {
  std::size_t samples = 0;
  for (const TrackView& view : tracks.views()) samples += view.track->samples.size();
  const std::size_t every = samples / kMostPoints + 1;
  std::vector<MapPoint> points;
  std::size_t next = 0;
  for (const TrackView& view : tracks.views())
    for (const Sample& sample : view.track->samples)
      if (next++ % every == 0) points.push_back({sample.x_mm, sample.y_mm, 0});
  return points;
}

/// Adds `factor` times the effect of some blocks of a term on the target there.
void add_effect(std::vector<MapPoint>& points, const Term& term, Target target, double factor,
                std::size_t first_block = 0, std::size_t end_block = SIZE_MAX) {
  std::array<double, kMostColumns> values;
  Situation s;
  for (MapPoint& point : points) {
    s.x_mm = point.x_mm;
    s.y_mm = point.y_mm;
    Eigen::Index first = 0;
    for (std::size_t b = 0; b < std::min(end_block, term.blocks.size()); ++b) {
      const Block& block = term.blocks[b];
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      if (block.target == target && b >= first_block) {
        block.basis.evaluate(s, 0, values.data());
        point.value +=
            factor * term.coefficients.segment(first, n).dot(Eigen::Map<Eigen::VectorXd>(values.data(), n));
      }
      first += n;
    }
  }
}

double sum_of_squares(const std::vector<MapPoint>& points) {
  double sum = 0;
  for (const MapPoint& point : points) sum += point.value * point.value;
  return sum;
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
    // Negated, so that a share that is no number is not better.
    if (!(explained > most)) return false;
    most = explained;
    best = disc;
    return true;
  };
  for (int j = 0; j < kPlacesAcross; ++j)
    for (int i = 0; i < kPlacesAcross; ++i)
      for (const double radius : kDiscRadii)
        better({e.x_low_mm + (i + 0.5) / kPlacesAcross * (e.x_high_mm - e.x_low_mm),
                e.y_low_mm + (j + 0.5) / kPlacesAcross * (e.y_high_mm - e.y_low_mm), radius * side});
  double length = side / kPlacesAcross;
  while (length > side / 400) {
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
    length /= 2;
  }
  return best;
}

/// The disc that explains most of what the circles so far leave of the map; nothing: no large part of `all`, its sum of squares.
std::optional<Disc> next_disc(std::vector<MapPoint> left, const Term* circles, Target target, const Extent& extent,
                              double all) {
  if (circles != nullptr) add_effect(left, *circles, target, -1);
  subtract_mean(left);
  const Disc disc = best_disc(left, extent);
  if (!(contrast_of(left, disc).explained > kLeastShare * all)) return std::nullopt;
  return disc;
}

/// The radius of each circle at which an edge about its centre explains most of what the other circles leave of the map.
std::vector<double> radii_of(const std::vector<MapPoint>& map, const Term& circles, Target target,
                             const Extent& extent) {
  constexpr int kRadii = 200;
  const double side = std::max(extent.x_high_mm - extent.x_low_mm, extent.y_high_mm - extent.y_low_mm);
  std::vector<double> radii_mm;
  for (std::size_t b = 0; b < circles.blocks.size(); ++b) {
    std::vector<MapPoint> left = map;
    add_effect(left, circles, target, -1, 0, b);
    add_effect(left, circles, target, -1, b + 1);
    subtract_mean(left);
    const MovingPoint& centre = circles.blocks[b].basis.factors.front().axis.point;
    double most = -1, radius_mm = 0;
    for (int i = 1; i <= kRadii; ++i) {
      const Disc disc{centre.x_mm, centre.y_mm, side * i / kRadii};
      const double explained = contrast_of(left, disc).explained;
      if (!(explained > most)) continue;
      most = explained;
      radius_mm = disc.radius_mm;
    }
    radii_mm.push_back(radius_mm);
  }
  return radii_mm;
}

/// Share of the variance of the circles' curves that a step in each of them explains, at these radii.
double share_of_steps(const std::vector<MapPoint>& map, const Term& circles, Target target,
                      const std::vector<double>& radii_mm) {
  double explained = 0, all = 0;
  for (std::size_t b = 0; b < circles.blocks.size(); ++b) {
    std::vector<MapPoint> curve = map;
    for (MapPoint& point : curve) point.value = 0;
    add_effect(curve, circles, target, 1, b, b + 1);
    subtract_mean(curve);
    const MovingPoint& centre = circles.blocks[b].basis.factors.front().axis.point;
    explained += contrast_of(curve, {centre.x_mm, centre.y_mm, radii_mm[b]}).explained;
    all += sum_of_squares(curve);
  }
  return all > 0 ? explained / all : 0;
}

Factor& curve_of(Block& block) { return block.basis.factors.front(); }

/// Moves the centres of all circles of a term. Returns whether the likelihood rose.
bool move_centres(const Fitter& fitter, FitState& state, std::size_t place) {
  NumberSteps steps;
  steps.slopes = [place](const FitState& now) {
    std::vector<Block> slopes;
    for (std::size_t b = 0; b < now.model.terms[place].blocks.size(); ++b) {
      slopes.push_back(derivatives_of(now.model.terms[place], b, 1));
      // The centre's place alone: the circle stands still.
      slopes.back().basis.chosen = {0, 1};
    }
    return slopes;
  };
  steps.move = [place](FitState& trial, const Eigen::VectorXd& step_mm) {
    Eigen::Index i = 0;
    for (Block& block : trial.model.terms[place].blocks) {
      MovingPoint& point = curve_of(block).axis.point;
      point.x_mm += step_mm[i++];
      point.y_mm += step_mm[i++];
    }
  };
  steps.most = 5;
  steps.largest_step = 40;  // mm
  double likelihood = fitter.log_likelihood(state);
  return move_numbers(fitter, state, steps, likelihood);
}

/// Adds a curve about the centre of a disc to a term, and moves all centres to where they are most likely.
void add_curve(const Fitter& fitter, FitState& state, std::size_t place, Target target, const Disc& disc) {
  constexpr std::uint32_t kColumns = 16;
  Term& term = state.model.terms[place];
  term.blocks.push_back({target, Basis{{curve_about(state, {disc.x_mm, disc.y_mm}, kColumns)}}, kDriven});
  const auto added = static_cast<Eigen::Index>(term.blocks.back().basis.size()), had = term.coefficients.size();
  term.coefficients.conservativeResize(had + added);
  term.precision.conservativeResize(had + added);
  term.coefficients.tail(added).setZero();
  term.precision.tail(added).setConstant(1 / (kCircleSd * kCircleSd));
  for (int pass = 0; pass < 2; ++pass) {
    refit(fitter, state, place);
    settle(fitter, state);
    if (!move_centres(fitter, state, place)) break;
  }
}

/// The term with one step per circle in place of its curves. The radii begin at these.
FitState with_edges(const Fitter& fitter, FitState state, std::size_t place, const std::vector<double>& radii_mm,
                    std::uint64_t most_work) {
  put_edges(fitter, state, place, radii_mm);
  std::vector<MoveNumber> radii, all;
  for (std::size_t b = 0; b < radii_mm.size(); ++b) {
    all.push_back([b](Term& term, double by_mm) { curve_of(term.blocks[b]).axis.point.x_mm += by_mm; });
    all.push_back([b](Term& term, double by_mm) { curve_of(term.blocks[b]).axis.point.y_mm += by_mm; });
    radii.push_back([b](Term& term, double by_mm) { curve_of(term.blocks[b]).points.front() += by_mm; });
    all.push_back(radii.back());
  }
  climb(fitter, state, place, 12, radii, most_work);
  climb(fitter, state, place, 2, all, most_work);
  refit(fitter, state, place);
  return state;
}

/// Whether the centres of all circles lie where robots were. Far from there a circle is a straight line.
bool lies_within(const Term& term, const Extent& e) {
  return std::all_of(term.blocks.begin(), term.blocks.end(), [&](const Block& block) {
    const MovingPoint& point = block.basis.factors.front().axis.point;
    return point.x_mm > e.x_low_mm && point.x_mm < e.x_high_mm && point.y_mm > e.y_low_mm &&
           point.y_mm < e.y_high_mm;
  });
}

/// Returns whether circles replaced the map.
bool replace_by_circles(const Fitter& fitter, FitState& state, std::size_t place, std::uint64_t most_work) {
  const std::optional<Target> target = target_of_map(state.model.terms[place]);
  if (!target || state.tracks.work() >= most_work) return false;
  const Extent extent = extent_of(state.tracks);
  std::vector<MapPoint> map = positions_of(state.tracks);
  add_effect(map, state.model.terms[place], *target, 1);
  subtract_mean(map);
  const double all = sum_of_squares(map);
  FitState circles = state;
  const auto at = circles.model.terms.begin() + static_cast<std::ptrdiff_t>(place);
  circles.model.terms.erase(at);
  settle(fitter, circles);
  const double had = fitter.log_likelihood(state), without = fitter.log_likelihood(circles),
               least = had - kLoss - kLossShare * (had - without);
  std::optional<FitState> best;
  double most = -INFINITY, reached = -INFINITY;
  for (std::size_t n = 1; n <= kMostCircles && state.tracks.work() < most_work; ++n) {
    const std::optional<Disc> disc =
        next_disc(map, n == 1 ? nullptr : &circles.model.terms[place], *target, extent, all);
    if (!disc) break;
    if (n == 1)
      circles.model.terms.insert(circles.model.terms.begin() + static_cast<std::ptrdiff_t>(place),
                                 Term{state.model.terms[place].name, {}, {}, {}});
    add_curve(fitter, circles, place, *target, *disc);
    if (!lies_within(circles.model.terms[place], extent)) break;
    const double numbers = kCircleNumber * 3 * static_cast<double>(circles.model.terms[place].blocks.size());
    const auto better = [&](const FitState& trial) {
      const double value = fitter.log_evidence(trial) - numbers, likelihood = fitter.log_likelihood(trial);
      reached = std::max(reached, likelihood);
      // Negated, so that a likelihood that is no number is not better.
      if (!(likelihood > least) || !(value > most)) return;
      most = value;
      best = trial;
    };
    better(circles);
    // Curves reach most of what edges reach.
    if (!(reached - without > kLeastCurves * static_cast<double>(n) * (had - without))) break;
    const std::vector<double> radii_mm = radii_of(map, circles.model.terms[place], *target, extent);
    if (share_of_steps(map, circles.model.terms[place], *target, radii_mm) > kLeastSteps)
      better(with_edges(fitter, circles, place, radii_mm, most_work));
    // So few circles will not do.
    if (!(reached - without > kLeastOfEach * static_cast<double>(n) * (had - without))) break;
  }
  if (!best) return false;
  state = std::move(*best);
  return true;
}

}  // namespace

void fit_circles(const Fitter& fitter, Search& found) {
  Stage before{found.fit, found.reasons};
  const auto searched = static_cast<double>(found.fit.tracks.work());
  const auto most_work =
      static_cast<std::uint64_t>(searched + std::clamp(kShareOfWork * searched, kLeastWork, kMostOfWork));
  bool replaced = false;
  for (std::size_t t = 0; t < found.fit.model.terms.size(); ++t)
    replaced = replace_by_circles(fitter, found.fit, t, most_work) || replaced;
  replaced = sharpen_moving_circles(fitter, found, most_work) || replaced;
  if (replaced) found.with_curves = std::move(before);
}

}  // namespace kilotwin::identify
