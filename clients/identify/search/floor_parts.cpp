#include "clients/identify/search/floor_parts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/search/circle_edges.hpp"
#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/map_parts.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/number_steps.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Discs or half planes in place of a map; more are tried one by one, each at the cost of several fits.
constexpr std::size_t kMostParts = 3;
/// A further part explains at least this share of the map's variance. Beside a high step, a slope is a small share and many nats.
constexpr double kLeastShare = 0.003;
/// Parts have far fewer numbers than the map: the loss of log likelihood that they may have, absolute and as a share of what the
/// map explains. A map with sharp edges follows chance by some percent.
constexpr double kLoss = 10, kLossShare = 0.15;
/// The share of the map's gain that n parts have to reach over n, or no further one is tried; and that of curves, or no edge is tried.
constexpr double kLeastOfEach = 0.25, kLeastCurves = 0.15;
/// Share of the variance of a part's curve that one step has to explain, or no edge is tried. Measured in scenes with
/// patches: 0.84 to 0.92; of a smooth peak 0.72.
constexpr double kLeastSteps = 0.78;
/// A large disc can stand for a half plane, which has a number less and is taken if it explains at least this share of what the
/// disc does.
constexpr double kHalfPlanes = 0.95;
/// Numbers of a circle that moves and grows.
constexpr double kNumbersOfMotion = 5;
/// Work that parts may cost: a share of that of the search, between these bounds. Beyond, the map stays unless parts so far are
/// better. In a small set, two patches cost 1.3 times their search; the lower bound is enough for that.
constexpr double kShareOfWork = 0.8, kLeastWork = 5e7, kMostOfWork = 1.5e8;

bool is_of_place(const Axis& axis) { return axis.of == Covariate::kX || axis.of == Covariate::kY; }
bool is_of_place(const Basis& basis) {
  return !basis.factors.empty() && std::all_of(basis.factors.begin(), basis.factors.end(), [](const Factor& f) {
    return is_of_place(f.axis) && (!f.of_two() || is_of_place(f.and_axis));
  });
}

const Axis& axis_of(const Block& block) { return block.basis.factors.front().axis; }

/// The target of the parts of a map of the speed, of one wheel or both, or of the turn rate; nothing: the term is no such map.
std::optional<Target> target_of_map(const Term& term) {
  const Target target = term.blocks.front().target;
  if (!is_gain(target) && target != Target::kTurn) return std::nullopt;
  bool of_both = false;
  for (const Block& block : term.blocks) {
    const bool same = block.target == target, other_wheel = is_gain(block.target) && is_gain(target) && !same;
    if (block.during != kDriven || ((same || other_wheel) && !is_of_place(block.basis))) return std::nullopt;
    of_both = of_both || other_wheel;
  }
  return of_both ? Target::kGain : target;
}

/// Whether a term is a circle that moves or grows. The slope of a floor, or the border of two, may look like a large one.
bool is_of_motion(const Term& term) {
  return is_moving_circle(term) && !axis_of(term.blocks.front()).point.stands();
}

bool is_disc(const Axis& axis) { return axis.of == Covariate::kPointDistance; }

/// The part that explains most of what those so far leave of the map; nothing: no large share of `all`, its sum of squares.
std::optional<MapPart> next_part(std::vector<MapPoint> left, const Term* parts, Target target, const Extent& extent,
                                 double all) {
  if (parts != nullptr) add_effect(left, *parts, target, -1);
  subtract_mean(left);
  const MapPart disc = best_disc(left, extent), half = best_half_plane(left, extent);
  const double of_disc = explained_by(left, disc), of_half = explained_by(left, half);
  const bool takes_half = of_half > kHalfPlanes * of_disc;
  if (!((takes_half ? of_half : of_disc) > kLeastShare * all)) return std::nullopt;
  return takes_half ? half : disc;
}

/// The edge of the last part: the one that explains most of what the other parts leave of the map. Then the share of the variance of
/// that part's curve that a step there explains.
std::pair<double, double> edge_of_last(const std::vector<MapPoint>& map, const Term& parts, Target target) {
  const std::size_t last = parts.blocks.size() - 1;
  const Axis& axis = axis_of(parts.blocks[last]);
  std::vector<MapPoint> left = map, curve = map;
  add_effect(left, parts, target, -1, 0, last);
  subtract_mean(left);
  const double edge_mm = best_edge_mm(left, axis);
  for (MapPoint& point : curve) point.value = 0;
  add_effect(curve, parts, target, 1, last);
  subtract_mean(curve);
  const double all = sum_of_squares(curve);
  return {edge_mm, all > 0 ? explained_by(curve, {axis, edge_mm}) / all : 0};
}

Factor& curve_of(Block& block) { return block.basis.factors.front(); }

bool is_curve(const Block& block) { return block.basis.factors.front().shape == Shape::kCosines; }

/// Moves the centres and turns the directions of all curves of a term. Returns whether the likelihood rose.
bool move_parts(const Fitter& fitter, FitState& state, std::size_t place) {
  NumberSteps steps;
  steps.slopes = [place](const FitState& now) {
    std::vector<Block> slopes;
    for (std::size_t b = 0; b < now.model.terms[place].blocks.size(); ++b) {
      if (!is_curve(now.model.terms[place].blocks[b])) continue;
      slopes.push_back(derivatives_of(now.model.terms[place], b, 1));
      // The centre's place alone: the circle stands still.
      if (is_disc(axis_of(slopes.back()))) slopes.back().basis.chosen = {0, 1};
    }
    return slopes;
  };
  steps.move = [place](FitState& trial, const Eigen::VectorXd& step) {
    Eigen::Index i = 0;
    for (Block& block : trial.model.terms[place].blocks) {
      if (!is_curve(block)) continue;
      Axis& axis = curve_of(block).axis;
      if (is_disc(axis)) {
        axis.point.x_mm += step[i++];
        axis.point.y_mm += step[i++];
      } else {
        axis.along_rad += step[i++] * Factor::kDirectionUnit_rad;
      }
    }
  };
  steps.most = 5;
  steps.largest_step = 40;  // mm, or that many units of a direction
  double likelihood = fitter.log_likelihood(state);
  return move_numbers(fitter, state, steps, likelihood);
}

/// Adds a curve over the coordinate of a part to a term, and moves all curves to where they are most likely.
void add_curve(const Fitter& fitter, FitState& state, std::size_t place, Target target, const MapPart& part) {
  // Cosines of a part's curve; more follow a sharp edge closer, and chance too.
  constexpr std::uint32_t kColumns = 16;
  Term& term = state.model.terms[place];
  term.blocks.push_back({target, Basis{{curve_over(state, part.axis, kColumns)}}, kDriven});
  const auto added = static_cast<Eigen::Index>(term.blocks.back().basis.size()), had = term.coefficients.size();
  term.coefficients.conservativeResize(had + added);
  term.precision.conservativeResize(had + added);
  term.coefficients.tail(added).setZero();
  term.precision.tail(added).setConstant(1 / (kCircleSd * kCircleSd));
  for (int pass = 0; pass < 2; ++pass) {
    refit(fitter, state, place);
    settle(fitter, state);
    if (!move_parts(fitter, state, place)) break;
  }
}

/// The term with a step in place of the curve of its last part. Its edge begins there.
FitState with_edge(const Fitter& fitter, FitState state, std::size_t place, double edge_mm, const Extent& extent,
                   std::uint64_t most_work) {
  Term& term = state.model.terms[place];
  Block& last = term.blocks.back();
  const Eigen::Index others = term.coefficients.size() - static_cast<Eigen::Index>(last.basis.size());
  last.basis.chosen.clear();
  curve_of(last).shape = Shape::kAtLeast;
  curve_of(last).points = {edge_mm};
  term.coefficients.conservativeResize(others + 1);
  term.precision.conservativeResize(others + 1);
  term.coefficients[others] = 0;
  term.precision[others] = 1 / (kCircleSd * kCircleSd);
  settle(fitter, state);
  const double half_side_mm = std::max(extent.x_high_mm - extent.x_low_mm, extent.y_high_mm - extent.y_low_mm) / 2;
  std::vector<MoveNumber> all;
  for (std::size_t b = 0; b < state.model.terms[place].blocks.size(); ++b) {
    const Block& block = state.model.terms[place].blocks[b];
    if (is_curve(block)) continue;
    if (is_disc(axis_of(block))) {
      all.push_back([b](Term& moved, double by_mm) { curve_of(moved.blocks[b]).axis.point.x_mm += by_mm; });
      all.push_back([b](Term& moved, double by_mm) { curve_of(moved.blocks[b]).axis.point.y_mm += by_mm; });
    } else {
      all.push_back([b, half_side_mm](Term& moved, double by_mm) {
        curve_of(moved.blocks[b]).axis.along_rad += by_mm / half_side_mm;
      });
    }
    all.push_back([b](Term& moved, double by_mm) { curve_of(moved.blocks[b]).points.front() += by_mm; });
  }
  climb(fitter, state, place, 12, {all.back()}, most_work);
  climb(fitter, state, place, state.model.terms[place].blocks.size() > 1 ? 6 : 2, all, most_work);
  refit(fitter, state, place);
  return state;
}

/// Whether the centres of all circles lie where robots were. Far from there a circle is a straight line.
bool lies_within(const Term& term, const Extent& e) {
  return std::all_of(term.blocks.begin(), term.blocks.end(), [&](const Block& block) {
    const MovingPoint& point = axis_of(block).point;
    return !is_disc(axis_of(block)) || (point.x_mm > e.x_low_mm && point.x_mm < e.x_high_mm &&
                                        point.y_mm > e.y_low_mm && point.y_mm < e.y_high_mm);
  });
}

/// Log of the number of choices for all numbers of the parts of a term: those of place or direction, and of an edge.
double cost_of_numbers(const Term& term) {
  double numbers = 0;
  for (const Block& block : term.blocks) numbers += is_disc(axis_of(block)) ? 3 : 2;
  return kCircleNumber * numbers;
}

/// Returns whether parts replaced the map.
bool replace_by_parts(const Fitter& fitter, FitState& state, std::size_t place, std::uint64_t most_work) {
  const bool moves = is_of_motion(state.model.terms[place]);
  const std::optional<Target> target = moves ? Target::kGain : target_of_map(state.model.terms[place]);
  if (!target || state.tracks.work() >= most_work) return false;
  // Names are the keys of a result: steps and ambiguities refer to terms by them.
  const std::string of_position = effect_name(kSpeed, "position");
  const bool taken = std::any_of(state.model.terms.begin(), state.model.terms.end(),
                                 [&](const Term& term) { return term.name == of_position; });
  if (moves && taken) return false;
  const Extent extent = extent_of(state.tracks);
  std::vector<MapPoint> map = positions_of(state.tracks);
  add_effect(map, state.model.terms[place], *target, 1);
  subtract_mean(map);
  const double all = sum_of_squares(map);
  FitState parts = state;
  const auto at = parts.model.terms.begin() + static_cast<std::ptrdiff_t>(place);
  parts.model.terms.erase(at);
  settle(fitter, parts);
  const double had = fitter.log_likelihood(state), without = fitter.log_likelihood(parts),
               least = had - kLoss - kLossShare * (had - without);
  std::optional<FitState> best;
  // A circle that moves has no more numbers than parts of the floor: it goes if its evidence is smaller.
  double most = moves ? fitter.log_evidence(state) - kCircleNumber * kNumbersOfMotion : -INFINITY;
  for (std::size_t n = 1; n <= kMostParts && state.tracks.work() < most_work; ++n) {
    const std::optional<MapPart> part =
        next_part(map, n == 1 ? nullptr : &parts.model.terms[place], *target, extent, all);
    if (!part) break;
    if (n == 1)
      parts.model.terms.insert(parts.model.terms.begin() + static_cast<std::ptrdiff_t>(place),
                               Term{moves ? of_position : state.model.terms[place].name, {}, {}, {}});
    const double fewer = n == 1 ? -INFINITY : fitter.log_likelihood(parts);
    add_curve(fitter, parts, place, *target, *part);
    if (!lies_within(parts.model.terms[place], extent) || !(fitter.log_likelihood(parts) > fewer + kLoss)) break;
    // Curves reach most of what edges reach.
    if (!(fitter.log_likelihood(parts) - without > kLeastCurves * static_cast<double>(n) * (had - without))) break;
    const auto [edge_mm, share] = edge_of_last(map, parts.model.terms[place], *target);
    if (share > kLeastSteps) {
      FitState sharp = with_edge(fitter, parts, place, edge_mm, extent, most_work);
      if (fitter.log_evidence(sharp) > fitter.log_evidence(parts)) parts = std::move(sharp);
    }
    const double value = fitter.log_evidence(parts) - cost_of_numbers(parts.model.terms[place]),
                 likelihood = fitter.log_likelihood(parts);
    if (likelihood > least && value > most) {
      most = value;
      best = parts;
    }
    // So few parts will not do.
    if (!(likelihood - without > kLeastOfEach * static_cast<double>(n) * (had - without))) break;
  }
  if (!best) return false;
  state = std::move(*best);
  return true;
}

}  // namespace

void fit_floor_parts(const Fitter& fitter, Search& found) {
  Stage before{found.fit, found.reasons};
  const auto searched = static_cast<double>(found.fit.tracks.work());
  const auto most_work =
      static_cast<std::uint64_t>(searched + std::clamp(kShareOfWork * searched, kLeastWork, kMostOfWork));
  bool replaced = false;
  for (std::size_t t = 0; t < found.fit.model.terms.size(); ++t) {
    const std::string name = found.fit.model.terms[t].name;
    if (!replace_by_parts(fitter, found.fit, t, most_work)) continue;
    replaced = true;
    if (found.fit.model.terms[t].name == name) continue;
    found.reasons[t].covariates = {"position"};
    found.note_renamed(name, found.fit.model.terms[t].name);
  }
  replaced = sharpen_moving_circles(fitter, found, most_work) || replaced;
  if (replaced) found.with_curves = std::move(before);
}

}  // namespace kilotwin::identify
