#include "clients/identify/fit/geometry_intervals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "clients/identify/fit/likelihood.hpp"
#include "clients/identify/fit/profile.hpp"
#include "clients/identify/fit/wall_detection.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Start of the search for an end of an interval, and distance from which on the end counts as unknown. Another start costs
/// some steps.
constexpr double kFirst_mm = 0.15, kFarthest_mm = 10;
/// Samples by which the disc centre is judged. More would narrow its interval, and take a noticeable share of the time.
constexpr std::size_t kSamplesOfCentre = 2000;

struct Side {
  double Walls::*wall;
  double Sample::*along;
};
constexpr std::array<Side, 4> kSides = {{{&Walls::x_low_mm, &Sample::x_mm},
                                         {&Walls::x_high_mm, &Sample::x_mm},
                                         {&Walls::y_low_mm, &Sample::y_mm},
                                         {&Walls::y_high_mm, &Sample::y_mm}}};

/// Tracks of the fit that came near a wall, at most kMost.
std::vector<const TrackView*> tracks_near(const FitState& state, const Side& side) {
  constexpr std::size_t kMost = 4;  // tracks; more narrow the interval, and cost time in proportion
  // Distance from the wall, beside the offset of the disc centre; a larger one counts free samples.
  constexpr double kNear_mm = 8;
  constexpr std::ptrdiff_t kFewest = 5;  // samples near the wall; tracks without more of them tell nothing of it
  const BaseParameters& base = state.model.base;
  const double near_mm = kNear_mm + std::abs(base.centre_mm - base.ahead_mm);
  std::vector<const TrackView*> near;
  for (const TrackView& view : state.tracks.views()) {
    if (view.track->held_out || near.size() == kMost) continue;
    const auto there = std::count_if(view.track->samples.begin(), view.track->samples.end(), [&](const Sample& s) {
      return std::abs(s.*side.along - state.model.walls.*side.wall) < near_mm;
    });
    if (there > kFewest) near.push_back(&view);
  }
  return near;
}

double log_likelihood_of(const MotionModel& model, const std::vector<const TrackView*>& tracks,
                         std::uint32_t threads) {
  std::vector<double> sums(tracks.size());
  os::in_parallel(tracks.size(), threads,
                  [&](std::size_t i) { sums[i] = likelihood_of(model, *tracks[i], true).sum; });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// How far a number may move to each side. `likelihood(by)`: log likelihood with the number moved.
struct Distances {
  double below, above;
};
template <class Likelihood> Distances distances_of(Likelihood&& likelihood, double dispersion) {
  const double here = likelihood(0.0);
  const auto distance = [&](double sign) {
    return profile_distance([&](double by) { return here - likelihood(sign * by); }, kFirst_mm, kFarthest_mm,
                            dispersion * kProfileDrop95);
  };
  return {distance(-1), distance(1)};
}

}  // namespace

GeometryIntervals geometry_intervals_of(const Fitter& fitter, const FitState& state,
                                        const Uncertainty& uncertainty) {
  const MotionModel& model = state.model;
  GeometryIntervals out;
  if (model.walls_uncertain) return out;
  for (const Side& side : kSides) {
    const double at = model.walls.*side.wall;
    if (!std::isfinite(at)) continue;
    const std::vector<const TrackView*> near = tracks_near(state, side);
    // A wall that the other sides imply.
    if (near.empty()) continue;
    const Distances by = distances_of(
        [&](double move) {
          MotionModel moved = model;
          moved.walls.*side.wall += move;
          return log_likelihood_of(moved, near, fitter.threads());
        },
        uncertainty.dispersion);
    out.low.*side.wall = at - by.below;
    out.high.*side.wall = at + by.above;
  }
  if (!model.walls.any()) return out;
  const Distances by = distances_of(
      [&](double move) {
        FitState moved = state;
        moved.model.base.centre_mm += move;
        moved.tracks.find_centres(moved.model, fitter.threads());
        if (moved.tracks.set().has_headings && !moved.model.measures())
          moved.model.walls = detected_walls(moved.tracks, moved.model);
        return log_likelihood_of(moved.model, moved.tracks.some_tracks(kSamplesOfCentre), fitter.threads());
      },
      uncertainty.dispersion);
  if (std::isfinite(by.below)) out.centre_low_mm = model.base.centre_mm - by.below;
  if (std::isfinite(by.above)) out.centre_high_mm = model.base.centre_mm + by.above;
  return out;
}

}  // namespace kilotwin::identify
