#include "clients/track/follow.hpp"

#include <algorithm>
#include <cmath>

#include "clients/track/assignment.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// Gate: quantile 0.9997 of the chi-squared distribution with two degrees of freedom.
constexpr double kGate = 16.2;
/// Assignments whose log likelihoods differ by less are ambiguous (a ratio of about 90).
constexpr double kMargin = 9;
/// A new robot is confirmed when it was seen in so many frames, and given up when it was missed in so many before.
constexpr int kConfirm = 3, kGiveUp = 3;
/// Share of the radius by which a fitted centre may be off for reasons that its deviation does not know.
constexpr double kShift = 0.07;
/// A robot that may be held with this probability does not show how robots carry their LED, and what they look like.
constexpr double kMostHeld = 0.1;
/// No robot is faster.
constexpr double kTopSpeed_mm_s = 35;

}  // namespace

Follower::Follower(FollowLimits limits) : limits_(limits), led_bearing_(limits.led_from_heading_rad) {}

std::optional<Heading> Track::heading() const {
  std::optional<Heading> heading = heading_filter.heading();
  // A robot's LED is wrong by the same angle in all pictures. So the filter, which takes the errors as independent, is too sure.
  if (heading && shows_heading) heading->variance_rad2 += kRobotsDiffer_rad * kRobotsDiffer_rad;
  return heading;
}

void Follower::predict(double time_s) {
  time_s_ = std::max(time_s_, time_s);
  for (Track& track : tracks_) track.position.predict(time_s_);
}

double Follower::reach_mm(const Track& track) const {
  const Covariance c = track.position.covariance();
  const double by_filter = std::sqrt(kGate * std::max(c.xx, c.yy)) + 1;
  const double by_speed = kTopSpeed_mm_s * std::max(0.0, time_s_ - track.seen_s) + 0.15 * limits_.robot_radius_mm;
  return std::min(by_filter, by_speed);
}

void Follower::take(Track& track, std::size_t index, const Sighting& sighting) {
  track.position.update(sighting.x_mm, sighting.y_mm, sighting.error);
  track.sighting = index;
  track.seen_s = time_s_;
  track.state = track.doubt ? TrackState::kDoubt : TrackState::kSeen;
  if (sighting.led_clear || track.led_read.value_or(sighting.led) == sighting.led) track.led = sighting.led;
  track.led_read = sighting.led;
  track.path.add(time_s_, sighting.x_mm, sighting.y_mm);
  const double sd_mm = std::sqrt(0.5 * (sighting.error.xx + sighting.error.yy));
  const std::optional<ShownHeading> shown = shown_heading(track, sighting);
  track.shows_heading = shown || (track.shows_heading && !track.path.heading_rad());
  if (shown)
    track.heading_filter.update(time_s_, sighting.x_mm, sighting.y_mm, sd_mm, shown->heading_rad, shown->sd_rad);
  else
    track.heading_filter.update(time_s_, sighting.x_mm, sighting.y_mm, sd_mm);
}

std::optional<Follower::ShownHeading> Follower::shown_heading(const Track& track, const Sighting& sighting) {
  const bool held = track.heading_filter.modes()[HeadingFilter::kHeld] > kMostHeld;
  const std::optional<double> driven_rad = held ? std::nullopt : track.path.heading_rad();
  if (sighting.led_bearing_rad) return heading_of(led_bearing_, *sighting.led_bearing_rad, driven_rad);
  if (!sighting.body) return std::nullopt;
  // Judged first, then learned from: so the agreement is that of pictures which the pattern does not know.
  const std::optional<double> turned_rad = pattern_.heading_rad(*sighting.body);
  if (driven_rad) pattern_.learn(*sighting.body, *driven_rad);
  if (!turned_rad) return std::nullopt;
  return heading_of(pattern_bearing_, *turned_rad, driven_rad);
}

std::optional<Follower::ShownHeading> Follower::heading_of(LedBearing& mounted, double bearing_rad,
                                                           const std::optional<double>& driven_rad) {
  if (driven_rad) mounted.add(bearing_rad, *driven_rad);
  const std::optional<LedMount> mount = mounted.mount();
  if (!mount) return std::nullopt;
  return ShownHeading{wrapped(bearing_rad - mount->from_heading_rad), mount->sd_rad};
}

void Follower::miss(Track& track) const {
  track.sighting.reset();
  track.state = time_s_ - track.seen_s > limits_.predict_s ? TrackState::kLost : TrackState::kPredicted;
}

void Follower::begin(std::size_t index, const Sighting& sighting) {
  Track track(PositionFilter(time_s_, sighting.x_mm, sighting.y_mm, sighting.error));
  take(track, index, sighting);
  track.frames = track.hits = 1;
  // The robots of the first picture are there from the beginning.
  track.confirmed = first_;
  track.id = first_ ? next_id_++ : UINT32_MAX;
  tracks_.push_back(track);
}

void Follower::update(const std::vector<Sighting>& sightings) {
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const double reach = reach_mm(tracks_[t]);
    const Covariance c = tracks_[t].position.covariance();
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      const Sighting& seen = sightings[s];
      if (std::hypot(seen.x_mm - tracks_[t].position.x_mm(), seen.y_mm - tracks_[t].position.y_mm()) > reach)
        continue;
      // Discs do not overlap, so the gate may be wide: a lamp that goes on shifts the fitted centre for once.
      const Covariance error = seen.error.plus(Covariance::round(kShift * limits_.robot_radius_mm));
      const double distance2 = tracks_[t].position.distance2(seen.x_mm, seen.y_mm, error);
      if (distance2 > kGate) continue;
      const double spread = c.plus(error).determinant();
      // A track that was seen just before is preferred: log of the likelihood, and of its normalisation.
      const double unsure = std::clamp(std::log(std::max(spread, 1e-9) / 16), 0.0, 8.0);
      pairs.push_back({t, s, distance2 + unsure + (tracks_[t].confirmed ? 0 : 4)});
    }
  }
  constexpr double kAlone = kGate + 13;
  const Assignment assignment = assign(tracks_.size(), sightings.size(), pairs, kAlone, kMargin);
  std::vector<bool> taken(sightings.size(), false);
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    Track& track = tracks_[t];
    const std::optional<std::size_t> s = assignment.of_track[t];
    if (assignment.ambiguous[t] && track.confirmed && !track.doubt) {
      track.doubt = true;
      ++doubts_;
    }
    if (s) {
      taken[*s] = true;
      take(track, *s, sightings[*s]);
    } else {
      miss(track);
    }
    if (track.confirmed) continue;
    ++track.frames;
    if (s) ++track.hits;
    if (track.hits >= kConfirm) {
      track.confirmed = true;
      track.id = next_id_++;
    }
  }
  std::erase_if(tracks_, [&](const Track& track) {
    return track.confirmed ? time_s_ - track.seen_s > limits_.forget_s : track.frames - track.hits >= kGiveUp;
  });
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    // Two robots cannot be in one place.
    const bool free = std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& track) {
      return track.state != TrackState::kLost &&
             std::hypot(track.position.x_mm() - sightings[s].x_mm, track.position.y_mm() - sightings[s].y_mm) <
                 1.2 * limits_.robot_radius_mm;
    });
    if (!taken[s] && free) begin(s, sightings[s]);
  }
  first_ = first_ && sightings.empty();
  std::stable_sort(tracks_.begin(), tracks_.end(), [](const Track& a, const Track& b) { return a.id < b.id; });
}

void Follower::clear_doubt(std::uint32_t id) {
  for (Track& track : tracks_) {
    if (track.id == id) track.doubt = false;
  }
}

}  // namespace kilotwin::track
