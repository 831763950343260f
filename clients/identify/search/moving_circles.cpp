#include "clients/identify/search/moving_circles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/number_steps.hpp"
#include "clients/identify/search/visits.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Visits that the scan uses.
constexpr std::size_t kMostScanned = 12000, kFewestScanned = 500;
constexpr double kShortestRun_s = 24;
/// Positions along an axis, and radii as shares of the larger side of the visited area.
constexpr int kPlacesAcross = 6;
constexpr std::array<double, 3> kRadii = {0.12, 0.25, 0.45};
/// Circles of the scan from which an ascent starts, and circles that become hypotheses.
constexpr std::size_t kStarts = 8, kCircles = 2;
constexpr int kMostMoves = 300;
/// A circle stands still if centre and radius change by less than this share of a spacing of the scan.
constexpr double kStill = 0.5;

struct SpeedPoint {
  float x_mm, y_mm, part, score, information;  ///< part: of the run, 0..1
};

/// Start and end of the centre, and of the radius: x, y, radius, x, y, radius; mm.
using Circle = std::array<double, 6>;

std::vector<SpeedPoint> points_of(const Fitter& fitter, const FitState& state, double duration_s) {
  const Visits visits = visits_of(fitter, state, kDriven);
  std::vector<SpeedPoint> all;
  for (std::size_t r = 0; r < visits.runs.size(); ++r) {
    const double start_s = state.tracks.neighbours(r).instants() > 0 ? state.tracks.neighbours(r).time_s(0) : 0;
    for (std::size_t i = 0; i < visits.runs[r].size(); ++i) {
      const double part = (start_s + static_cast<double>(i) * visits.every_s) / duration_s;
      for (const Visit& v : visits.runs[r][i])
        if (v.information > 0) all.push_back({v.x_mm, v.y_mm, static_cast<float>(part), v.score, v.information});
    }
  }
  // Each visit stands for `every` of them, so that the gain is that of all.
  const std::size_t every = all.size() / kMostScanned + 1;
  std::vector<SpeedPoint> some;
  for (std::size_t i = 0; i < all.size(); i += every) {
    SpeedPoint sum = all[i];
    sum.score *= static_cast<float>(every);
    sum.information *= static_cast<float>(every);
    some.push_back(sum);
  }
  return some;
}

/// Sums over all points.
struct ScanTotal {
  double score = 0, information = 0;
};

/// Half the sum of squares that an amplitude within the circle explains, beside a constant.
double gain_of(const std::vector<SpeedPoint>& points, const ScanTotal& total, const Circle& circle) {
  std::array<float, 6> c;
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = static_cast<float>(circle[i]);
  double score = 0, information = 0;
  for (const SpeedPoint& p : points) {
    const float dx = p.x_mm - c[0] - p.part * (c[3] - c[0]), dy = p.y_mm - c[1] - p.part * (c[4] - c[1]),
                radius = std::max(0.0F, c[2] + p.part * (c[5] - c[2]));
    const float in = dx * dx + dy * dy < radius * radius ? 1.0F : 0.0F;
    score += static_cast<double>(in * p.score);
    information += static_cast<double>(in * p.information);
  }
  const double share = information / std::max(total.information, 1e-9);
  // Least share of the information in and outside a circle; smaller ones find circles about a few samples.
  constexpr double kLeast = 0.005;
  if (share < kLeast || share > 1 - kLeast) return 0;
  const double contrast = score - total.score * share;
  return 0.5 * contrast * contrast / (information * (1 - share));
}

struct CirclePeak {
  Circle circle;
  double gain;
};

CirclePeak climbed(const std::vector<SpeedPoint>& points, const ScanTotal& total, CirclePeak peak,
                   double spacing_mm) {
  int steps = 0;
  double length = 0.5 * spacing_mm;
  while (length > 0.02 * spacing_mm) {
    for (bool better = true; better && steps < kMostMoves; ++steps) {
      better = false;
      // Each number, then both positions and both radii together.
      constexpr std::array<std::array<std::size_t, 2>, 9> kMoves = {
          {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {5, 5}, {0, 3}, {1, 4}, {2, 5}}};
      for (const auto& [first, second] : kMoves) {
        for (const double sign : {1.0, -1.0}) {
          Circle trial = peak.circle;
          trial[first] += sign * length;
          if (second != first) trial[second] += sign * length;
          const double gain = gain_of(points, total, trial);
          if (gain <= peak.gain) continue;
          peak = {trial, gain};
          better = true;
        }
      }
    }
    length /= 2;
  }
  return peak;
}

double side_of(const Extent& e) { return std::max(e.x_high_mm - e.x_low_mm, e.y_high_mm - e.y_low_mm); }
double spacing_of(const Extent& e) { return side_of(e) / kPlacesAcross; }

/// Positions and radii at one instant: kPlacesAcross positions along each axis, with each radius.
std::vector<std::array<double, 3>> raster_of(const Extent& e) {
  std::vector<std::array<double, 3>> all;
  for (int j = 0; j < kPlacesAcross; ++j)
    for (int i = 0; i < kPlacesAcross; ++i)
      for (const double radius : kRadii)
        all.push_back({e.x_low_mm + (i + 0.5) / kPlacesAcross * (e.x_high_mm - e.x_low_mm),
                       e.y_low_mm + (j + 0.5) / kPlacesAcross * (e.y_high_mm - e.y_low_mm), radius * side_of(e)});
  return all;
}

bool stands_still(const Circle& c, double spacing_mm) {
  return std::hypot(c[3] - c[0], c[4] - c[1]) + std::abs(c[5] - c[2]) < kStill * spacing_mm;
}

MovingCircle circle_of(const CirclePeak& peak, double duration_s) {
  const Circle& c = peak.circle;
  return {{c[0], c[1], (c[3] - c[0]) / duration_s, (c[4] - c[1]) / duration_s, (c[5] - c[2]) / duration_s},
          c[2],
          peak.gain};
}

void set_centre(Term& term, const MovingPoint& centre) {
  for (Block& block : term.blocks)
    for (Factor& f : block.basis.factors)
      if (f.axis.of == Covariate::kPointDistance) f.axis.point = centre;
}

MovingPoint shifted_centre(MovingPoint p, const Eigen::VectorXd& step_mm, double unit_s) {
  p.x_mm += step_mm[0];
  p.y_mm += step_mm[1];
  p.velocity_x_mm_s += step_mm[2] / unit_s;
  p.velocity_y_mm_s += step_mm[3] / unit_s;
  p.growth_mm_s += step_mm[4] / unit_s;
  return p;
}

Axis about(const MovingPoint& centre) {
  Axis axis{Covariate::kPointDistance};
  axis.point = centre;
  return axis;
}

/// Whether a circle changes so little during a run that the scan would have left it out.
bool hardly_moves(const MovingPoint& p, const Extent& extent) {
  return extent.duration_s * (std::hypot(p.velocity_x_mm_s, p.velocity_y_mm_s) + std::abs(p.growth_mm_s)) <
         kStill * spacing_of(extent);
}

/// Sets velocity, growth or both to 0 if that is as likely. A circle that hardly moves may also fit what its curve does not, a
/// strength of each robot: then, standing, it may lose a share of what it explains. Returns whether one of them is 0 now that was not.
bool set_still(const Fitter& fitter, FitState& state, std::size_t place, double likelihood) {
  constexpr double kPerNumber = 3;  // as the choice of one number costs
  constexpr double kShare = 0.05;
  double may_lose = 0;
  if (hardly_moves(state.model.terms[place].blocks.front().basis.factors.front().axis.point,
                   extent_of(state.tracks))) {
    FitState without = state;
    without.model.terms.erase(without.model.terms.begin() + static_cast<std::ptrdiff_t>(place));
    fitter.fit(without, 1);
    may_lose = kShare * (likelihood - fitter.log_likelihood(without));
  }
  const MovingPoint now = state.model.terms[place].blocks.front().basis.factors.front().axis.point;
  const bool moves = now.velocity_x_mm_s != 0 || now.velocity_y_mm_s != 0, grows = now.growth_mm_s != 0;
  for (const auto& [still, constant] : {std::pair{true, true}, std::pair{true, false}, std::pair{false, true}}) {
    if ((still && !moves) || (constant && !grows)) continue;
    MovingPoint trial_centre = now;
    if (still) trial_centre.velocity_x_mm_s = trial_centre.velocity_y_mm_s = 0;
    if (constant) trial_centre.growth_mm_s = 0;
    FitState trial = state;
    set_centre(trial.model.terms[place], trial_centre);
    fitter.fit(trial, 2);
    if (!(fitter.log_likelihood(trial) >
          likelihood - std::max(may_lose, kPerNumber * ((still ? 2 : 0) + (constant ? 1 : 0)))))
      continue;
    state = std::move(trial);
    return true;
  }
  return false;
}

}  // namespace

Factor curve_over(const FitState& state, const Axis& axis, std::uint32_t count) {
  Factor curve = over(Factor::Shape::kCosines, axis.of, 1e300, -1e300, count);
  curve.axis = axis;
  for (const TrackView& view : state.tracks.views()) {
    Situation s;
    for (const Sample& sample : view.track->samples) {
      s.time_s = sample.time_s;
      s.x_mm = sample.x_mm;
      s.y_mm = sample.y_mm;
      const double at_mm = value_of(curve.axis, s, 0);
      curve.low = std::min(curve.low, at_mm);
      curve.high = std::max(curve.high, at_mm);
    }
  }
  return curve;
}

Block derivatives_of(const Term& term, std::size_t of_block, double unit_s) {
  Eigen::Index first = 0;
  for (std::size_t b = 0; b < of_block; ++b) first += static_cast<Eigen::Index>(term.blocks[b].basis.size());
  const Block& block = term.blocks[of_block];
  Factor shift = block.basis.factors.front();
  shift.points.assign(shift.columns(), 0);
  for (std::size_t i = 0; i < block.basis.size(); ++i)
    shift.points[block.basis.chosen.empty() ? i : block.basis.chosen[i]] =
        term.coefficients[first + static_cast<Eigen::Index>(i)];
  shift.shape = Factor::Shape::kPointShift;
  shift.count = static_cast<std::uint32_t>(unit_s);
  return {block.target, Basis{{shift}}, block.during};
}

std::vector<MovingCircle> moving_circles_of(const Fitter& fitter, const FitState& state, const Extent& extent) {
  std::vector<MovingCircle> circles;
  if (extent.duration_s < kShortestRun_s) return circles;
  const std::vector<SpeedPoint> points = points_of(fitter, state, extent.duration_s);
  if (points.size() < kFewestScanned) return circles;
  ScanTotal total;
  for (const SpeedPoint& p : points) {
    total.score += static_cast<double>(p.score);
    total.information += static_cast<double>(p.information);
  }
  const auto raster = raster_of(extent);
  // Of each start the best ends.
  std::vector<std::vector<CirclePeak>> found(raster.size());
  os::in_parallel(raster.size(), fitter.threads(), [&](std::size_t i) {
    for (const auto& end : raster) {
      const auto& start = raster[i];
      const Circle circle{start[0], start[1], start[2], end[0], end[1], end[2]};
      found[i].push_back({circle, gain_of(points, total, circle)});
    }
    std::stable_sort(found[i].begin(), found[i].end(),
                     [](const CirclePeak& a, const CirclePeak& b) { return a.gain > b.gain; });
    found[i].resize(1);
  });
  std::vector<CirclePeak> peaks;
  peaks.reserve(found.size());
  for (const auto& of_start : found) peaks.push_back(of_start.front());
  const auto by_gain = [](const CirclePeak& a, const CirclePeak& b) { return a.gain > b.gain; };
  std::stable_sort(peaks.begin(), peaks.end(), by_gain);
  peaks.resize(std::min(peaks.size(), kStarts));
  const double spacing_mm = spacing_of(extent);
  os::in_parallel(peaks.size(), fitter.threads(),
                  [&](std::size_t i) { peaks[i] = climbed(points, total, peaks[i], spacing_mm); });
  std::stable_sort(peaks.begin(), peaks.end(), by_gain);
  for (const CirclePeak& peak : peaks) {
    if (circles.size() == kCircles) break;
    if (!stands_still(peak.circle, spacing_mm)) circles.push_back(circle_of(peak, extent.duration_s));
  }
  return circles;
}

Dictionary dictionary_of_circles(const FitState& state, const Extent& extent,
                                 const std::vector<MovingCircle>& circles) {
  Dictionary dictionary;
  DictionaryBuilder make(dictionary);
  const double raster = static_cast<double>(raster_of(extent).size()), choices = raster * raster;
  // Cosines of a curve over the distance; more follow a sharp edge closer, and chance too.
  constexpr std::uint32_t kColumns = 16;
  for (const MovingCircle& circle : circles) {
    const auto bases = make.put(kSpeed, Basis{{curve_over(state, about(circle.centre), kColumns)}});
    for (const Eigen::Index size : {6, 16})
      make.add(kSpeed, "position-and-time", {"position", "time"}, some(bases, 0, size), choices);
  }
  make.finish();
  return dictionary;
}

bool is_moving_circle(const Term& term) {
  return !term.blocks.empty() && term.blocks.front().basis.factors.size() == 1 &&
         term.blocks.front().basis.factors.front().axis.of == Covariate::kPointDistance &&
         term.blocks.front().basis.factors.front().shape == Factor::Shape::kCosines;
}

bool refine_moving_circle(const Fitter& fitter, FitState& state, std::size_t place) {
  if (!is_moving_circle(state.model.terms[place])) return false;
  const double unit_s = std::max(1.0, std::round(extent_of(state.tracks).duration_s));
  NumberSteps steps;
  steps.slopes = [&](const FitState& now) {
    return std::vector<Block>{derivatives_of(now.model.terms[place], 0, unit_s)};
  };
  steps.move = [&](FitState& trial, const Eigen::VectorXd& step_mm) {
    Term& term = trial.model.terms[place];
    set_centre(term, shifted_centre(term.blocks.front().basis.factors.front().axis.point, step_mm, unit_s));
  };
  steps.largest_step = 60;  // mm
  double likelihood = fitter.log_likelihood(state);
  bool changed = move_numbers(fitter, state, steps, likelihood);
  changed = set_still(fitter, state, place, likelihood) || changed;
  const MovingPoint& centre = state.model.terms[place].blocks.front().basis.factors.front().axis.point;
  state.model.terms[place].name = effect_name(kSpeed, centre.stands() ? "position" : "position-and-time");
  return changed;
}

}  // namespace kilotwin::identify
