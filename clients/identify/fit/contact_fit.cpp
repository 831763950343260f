#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/os/worker_pool.hpp"

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/wall_detection.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// Displacement along an axis during contacts between robots, from the first to the last measurement of each
/// contact.
struct ContactPushes {
  explicit ContactPushes(double tracker_mm2) : tracker_mm2_(tracker_mm2) {}
  double sum_mm2 = 0, time_s = 0;
  std::size_t count = 0;

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) {
    if (record.at_robot) contact_s_ += record.h_s;
  }
  void update(const Innovation& innovation, const Sample&) {
    const double contact_s = std::exchange(contact_s_, 0);
    if (contact_s > 0 && !innovation.lost) {
      way_ += std::sqrt(innovation.weight) * innovation.difference.head<2>();
      way_s_ += contact_s;
    } else if (way_s_ > 0) {
      // The tracker's variance enters at both ends.
      sum_mm2 += way_.squaredNorm() / 2 - 2 * tracker_mm2_;
      time_s += std::exchange(way_s_, 0);
      ++count;
      way_.setZero();
    }
  }

 private:
  double tracker_mm2_, contact_s_ = 0, way_s_ = 0;
  Eigen::Vector2d way_ = Eigen::Vector2d::Zero();
};

}  // namespace

double contact_range_of(const BaseParameters& base, bool headings) {
  // Share of the offset between disc centre and tracked point by which places without headings may be off. A larger value
  // counts more robots as in contact.
  constexpr double kMostly = 0.75;
  return kContactRange_mm + (headings ? 0 : kMostly * std::abs(base.centre_mm - base.ahead_mm));
}

void Fitter::update_walls(FitState& state) const {
  if (!headings_) return;
  MotionModel& model = state.model;
  const Walls known = model.walls;
  model.walls = detected_walls(state.tracks, model);
  for (double Walls::*const side : {&Walls::x_low_mm, &Walls::x_high_mm, &Walls::y_low_mm, &Walls::y_high_mm})
    if (std::isinf(model.walls.*side)) model.walls.*side = known.*side;
}

void Fitter::fit_walls(FitState& state) const {
  MotionModel& model = state.model;
  std::size_t samples = 0;
  for (const TrackView& view : state.tracks.views()) samples += view.track->samples.size();
  // The ends of so few are chance.
  if (samples < 100) return;
  // Largest distance between the tracked point and the disc centre.
  const double reach = std::abs(model.base.centre_mm - model.base.ahead_mm);
  // The tracked point with the camera distortion removed.
  const bool measures = model.measures();
  const auto place_of = [&](const TrackView& view, const Sample& s) {
    if (!measures) return s;
    const Eigen::Vector3d pose = model.pose_of(s, view.at(s.time_s));
    const double c = std::cos(pose[2]), n = std::sin(pose[2]);
    return Sample{s.time_s, pose[0] + model.base.ahead_mm * c - model.base.left_mm * n,
                  pose[1] + model.base.ahead_mm * n + model.base.left_mm * c, pose[2]};
  };
  struct Side {
    double Walls::*wall;
    double Sample::*along;
    double sign;
  };
  const std::array<Side, 4> sides = {
      Side{&Walls::x_high_mm, &Sample::x_mm, 1}, Side{&Walls::x_low_mm, &Sample::x_mm, -1},
      Side{&Walls::y_high_mm, &Sample::y_mm, 1}, Side{&Walls::y_low_mm, &Sample::y_mm, -1}};
  // Positions of a side, mm: coarse steps from the edge of the visited places on, then fine ones about the best.
  constexpr double kCoarse_mm = 2, kInside_mm = 2, kBeyond_mm = 4;
  constexpr std::array<double, 4> kFine_mm = {-1.0, 1.0, -0.5, 0.5};
  const int coarse = static_cast<int>(std::floor((kInside_mm + reach + kBeyond_mm) / kCoarse_mm)) + 1;
  Walls reached;
  // Whether the side became a wall, by a gain of more than `least` in log likelihood.
  const auto fit_side = [&](const Side& side, double least) {
    std::vector<double> places;
    for (const TrackView& view : state.tracks.views())
      for (const Sample& s : view.track->samples) places.push_back(side.sign * place_of(view, s).*side.along);
    const double edge = stats::upper_end(places, std::max<std::size_t>(3, places.size() / 2000));
    // Its disc centre reached at least this place, whatever its heading.
    reached.*side.wall = side.sign * (edge - reach);
    // Tracks that came near the side, at most kMost.
    constexpr std::size_t kMost = 16;
    std::vector<const TrackView*> near;
    for (const TrackView& view : state.tracks.views()) {
      if (view.track->held_out || near.size() == kMost) continue;
      const auto there = std::count_if(
          view.track->samples.begin(), view.track->samples.end(),
          [&](const Sample& s) { return std::abs(side.sign * place_of(view, s).*side.along - edge) < reach + 5; });
      if (there > 5) near.push_back(&view);
    }
    model.walls.*side.wall = side.sign * std::numeric_limits<double>::infinity();
    if (near.empty()) return false;
    MotionModel best = model;
    double best_value = log_likelihood_with_contacts(model, near) + least;
    const auto try_at = [&](double wall) {
      MotionModel trial = model;
      trial.walls.*side.wall = side.sign * wall;
      const double value = log_likelihood_with_contacts(trial, near);
      if (value <= best_value) return;
      best_value = value;
      best = trial;
    };
    for (int i = 0; i < coarse; ++i) try_at(edge - kInside_mm + i * kCoarse_mm);
    const double found = side.sign * best.walls.*side.wall;
    if (std::isinf(found)) return false;
    for (const double by : kFine_mm) try_at(found + by);
    model = best;
    return true;
  };
  // Least gain of a wall, in log likelihood: covers chance and a few outliers. Three such walls make a fourth likely: then a
  // Bayes factor of 20 is enough, for the best of all its positions.
  constexpr double kSure = 30, kLikely = 3;
  const double positions = coarse + static_cast<double>(kFine_mm.size());
  std::vector<const Side*> open;
  for (const Side& side : sides) {
    // With headings, detected_walls() has found most walls already.
    if (headings_ && std::isfinite(model.walls.*side.wall)) continue;
    if (!fit_side(side, kSure)) open.push_back(&side);
  }
  if (open.size() == 1) fit_side(*open.front(), kLikely + std::log(positions));
  add_implied_side(model.walls, reached);
}

void Fitter::fit_contact_noise(FitState& state) const {
  MotionModel& model = state.model;
  const std::vector<const TrackView*> tracks = state.tracks.some_tracks(kEnoughSamples);
  double best = log_likelihood_with_contacts(model, tracks);
  const auto climb = [&](double Noise::*part) {
    const double start = model.noise.*part;
    for (const double factor : {4.0, 0.25}) {
      bool better = true;
      while (better) {
        MotionModel trial = model;
        trial.noise.*part *= factor;
        if (trial.noise.*part < 1e-6 || trial.noise.*part > 1e3) break;
        const double value = log_likelihood_with_contacts(trial, tracks);
        better = value > best + 0.5;
        if (!better) break;
        best = value;
        model = trial;
      }
      if (model.noise.*part != start) break;
    }
  };
  for (double Noise::*const part : {&Noise::wall_mm2_s, &Noise::wall_rad2_s, &Noise::contact_mm2_s}) climb(part);
  // A push keeps its direction during a contact. White noise fitted to single steps underestimates its sum, and
  // the fit would attribute the rest to turns.
  if (const double persistent_mm2_s = persistent_push_mm2_s(model, tracks);
      persistent_mm2_s > model.noise.contact_mm2_s) {
    model.noise.contact_mm2_s = persistent_mm2_s;
    best = log_likelihood_with_contacts(model, tracks);
  }
  climb(&Noise::contact_rad2_s);
}

double Fitter::persistent_push_mm2_s(const MotionModel& model, const std::vector<const TrackView*>& tracks) const {
  std::vector<ContactPushes> pushes(tracks.size(), ContactPushes(model.noise.position_mm2));
  os::in_parallel(tracks.size(), threads_, [&](std::size_t i) {
    RobotBias bias = model.bias_of(tracks[i]->track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, tracks[i]->track->robot, tracks[i]->number);
    run_filter(filter, *tracks[i], tracks[i]->track->samples.size(), pushes[i]);
  });
  std::size_t count = 0;
  double sum_mm2 = 0, time_s = 0;
  for (const ContactPushes& p : pushes) {
    count += p.count;
    sum_mm2 += p.sum_mm2;
    time_s += p.time_s;
  }
  constexpr std::size_t kFew = 10;     // contacts; with fewer, their mean square is too uncertain to be a noise
  constexpr double kMost_mm2_s = 1e3;  // largest variance, the bound that the fit of the noise has, too
  return count < kFew ? 0 : std::min(sum_mm2 / time_s, kMost_mm2_s);
}

void Fitter::fit_disc_centre(FitState& state) const {
  struct Candidate {
    FitState state;
    double log_likelihood = 0;
    Encounters encounters;
  };
  std::vector<Candidate> candidates;
  const auto add = [&](double centre_mm) {
    Candidate& c = candidates.emplace_back(Candidate{state, 0, {}});
    MotionModel& model = c.state.model;
    model.base.centre_mm = centre_mm;
    model.contact_range_mm = contact_range_of(model.base, headings_);
    c.state.tracks.find_centres(model, threads_);
    if (headings_) {
      model.walls = detected_walls(c.state.tracks, model);
    } else {
      fit_walls(c.state);
      // A candidate with more contacts needs contact noise of its own for a fair comparison.
      fit_contact_noise(c.state);
    }
    c.log_likelihood = log_likelihood_with_contacts(model, c.state.tracks.some_tracks(kEnoughSamples));
    c.encounters = c.state.tracks.encounters();
  };
  add(kAxleOffset_mm);
  // Alternative: the tracked point is the disc centre.
  constexpr double kApart_mm = 3;
  const double ahead_mm = state.model.base.ahead_mm;
  if (std::abs(ahead_mm - kAxleOffset_mm) > kApart_mm) add(ahead_mm);
  const Candidate* best = &candidates.front();
  for (const Candidate& c : candidates) {
    // Walls are stronger evidence than encounters. Without walls the likelihood is no evidence, because it only
    // depends on which samples count as contacts.
    constexpr double kSure = 50;
    const bool walls = c.state.model.walls.any() || best->state.model.walls.any();
    const double better = walls ? c.log_likelihood - best->log_likelihood : 0;
    if (better > kSure ||
        (better > -kSure && c.encounters.overlap_density() < 0.5 * best->encounters.overlap_density()))
      best = &c;
  }
  const Candidate* other = candidates.size() < 2    ? nullptr
                           : best == &candidates[0] ? &candidates[1]
                                                    : &candidates[0];
  const bool told = other != nullptr && (best->state.model.walls.any() || other->state.model.walls.any());
  const double evidence = told ? best->log_likelihood - other->log_likelihood : 0;
  state = best->state;
  state.model.centre_evidence = evidence;
  state.model.contacts = best->encounters.overlap_density() < Encounters::kNoCollisions;
}

void Fitter::fit_contacts(FitState& state) const {
  MotionModel& model = state.model;
  if (model.walls_uncertain) resolve_walls(state);
  // Large contact noise would hide wrong positions of the walls.
  const Noise initial;
  for (double Noise::*const part :
       {&Noise::wall_mm2_s, &Noise::wall_rad2_s, &Noise::contact_mm2_s, &Noise::contact_rad2_s})
    model.noise.*part = initial.*part;
  // A missing effect may have looked like a displaced disc centre. With headings, effects of the camera alone do.
  if (!headings_ || model.measures()) fit_disc_centre(state);
  for (int round = 0; round < (headings_ ? 1 : 2); ++round) {
    if (headings_ || round > 0) {
      fit_walls(state);
      state.tracks.find_centres(model, threads_);
    }
    if (model.measures() && correct_camera_scale(state)) state.tracks.find_centres(model, threads_);
    // Camera distortion shows false encounters and hides true ones.
    if (model.measures() && !model.walls_uncertain)
      model.contacts = state.tracks.encounters().overlap_density() < Encounters::kNoCollisions;
    fit_contact_noise(state);
    fit(state, 1);
  }
}

}  // namespace kilotwin::identify
