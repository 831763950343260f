#include "clients/track/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "clients/track/brightness.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// All of the picture is searched for new robots in this time, s, and in at most so many strips.
constexpr double kSearchAll_s = 0.35;
constexpr int kMostStrips = 12;

double distance(const Point& a, const Point& b) { return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px); }

std::vector<Circle> near(const std::vector<Circle>& discs, const Point& place, double reach_px, std::size_t but) {
  std::vector<Circle> found;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    if (i != but && distance(discs[i].centre, place) < reach_px) found.push_back(discs[i]);
  }
  return found;
}

}  // namespace

PictureTracker::PictureTracker(std::optional<FloorMap> floor, FollowLimits limits)
    : floor_(std::move(floor)), calibrated_(floor_.has_value()), follower_(limits) {}

std::optional<double> PictureTracker::radius_px(const cv::Size& picture) const {
  if (detector_.look()) return detector_.look()->radius_px;
  if (!calibrated_) return std::nullopt;
  return kRobotRadius_mm / floor_->mm_per_px({0.5 * picture.width, 0.5 * picture.height});
}

std::vector<Circle> PictureTracker::predicted_discs() const {
  std::vector<Circle> discs;
  for (const Track& track : follower_.tracks())
    discs.push_back({floor_->pixel({track.position.x_mm(), track.position.y_mm()}), detector_.look()->radius_px});
  return discs;
}

cv::Rect PictureTracker::next_strip(const cv::Size& picture, double time_s) {
  const double apart_s = last_s_ ? time_s - *last_s_ : kSearchAll_s;
  const int strips = std::clamp(cvRound(kSearchAll_s / std::max(apart_s, 1e-3)), 1, kMostStrips);
  strip_ = (strip_ + 1) % strips;
  const int margin = cvCeil(1.5 * detector_.look()->radius_px);
  const int top = picture.height * strip_ / strips - margin;
  const int bottom = picture.height * (strip_ + 1) / strips + margin;
  return {0, top, picture.width, bottom - top};
}

std::vector<Detection> PictureTracker::look(const cv::Mat& grey, double time_s) {
  if (calibrated_ && !detector_.look()) {
    // The calibration tells the robots' size. One that is wrong shall not hide them.
    Detector sized(radius_px(grey.size()));
    std::vector<Detection> found = sized.find(grey);
    if (!found.empty()) {
      detector_ = sized;
      return found;
    }
  }
  if (!detector_.look() || follower_.tracks().empty()) return detector_.find(grey);
  follower_.predict(time_s);
  const double radius = detector_.look()->radius_px;
  std::vector<Circle> discs = predicted_discs();
  std::vector<Detection> found;
  const auto add = [&](const Detection& detection) {
    const bool known = std::any_of(found.begin(), found.end(), [&](const Detection& other) {
      return distance(other.disc.centre, detection.disc.centre) < 1.2 * radius;
    });
    if (!known) found.push_back(detection);
  };
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Track& track = follower_.tracks()[i];
    const Point predicted = discs[i].centre;
    const double reach = follower_.reach_mm(track) / floor_->mm_per_px(predicted);
    const auto detection = detector_.find_near(grey, predicted, reach, near(discs, predicted, 3.2 * radius, i));
    if (!detection) continue;
    discs[i] = detection->disc;
    add(*detection);
  }
  // Lost robots hide nothing.
  std::vector<Circle> known;
  known.reserve(found.size());
  for (const Detection& detection : found) known.push_back(detection.disc);
  for (const Detection& detection : detector_.find_more(grey, next_strip(grey.size(), time_s), known))
    add(detection);
  return found;
}

Sighting PictureTracker::sighting_of(const cv::Mat& picture, const cv::Mat& grey,
                                     const std::vector<Detection>& found, std::size_t index) const {
  const Detection& detection = found[index];
  std::vector<Circle> others;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i != index) others.push_back(found[i].disc);
  }
  const LedReading led = read_led(picture, detection.disc, others);
  const FloorPoint at = floor_->floor(detection.disc.centre);
  Sighting sighting{at.x_mm, at.y_mm, floor_->covariance(detection.disc.centre, detection.error_px2), led.led,
                    std::nullopt};
  sighting.led_clear = led.clear;
  if (led.bearing_rad) sighting.led_bearing_rad = floor_->floor_direction(detection.disc.centre, *led.bearing_rad);
  if (led.led == Led::kOff) sighting.body = BodyPicture::of(grey, detection.disc.centre, *floor_);
  return sighting;
}

std::vector<TrackedRobot> PictureTracker::process(const cv::Mat& picture, double time_s) {
  const cv::Mat grey = grey_of(picture);
  const std::vector<Detection> found = look(grey, time_s);
  last_s_ = time_s;
  if (!floor_) {
    if (found.empty()) return {};
    floor_ = FloorMap::scale(picture.size(), kRobotRadius_mm / detector_.look()->radius_px);
  }
  follower_.predict(time_s);
  std::vector<Sighting> sightings;
  for (std::size_t i = 0; i < found.size(); ++i) sightings.push_back(sighting_of(picture, grey, found, i));
  follower_.update(sightings);

  std::vector<TrackedRobot> robots;
  for (const Track& track : follower_.tracks()) {
    if (!track.confirmed) continue;
    TrackedRobot robot;
    robot.track = track.id;
    robot.state = track.state;
    robot.position = {track.position.x_mm(), track.position.y_mm()};
    robot.covariance = track.position.covariance();
    robot.heading = track.heading();
    robot.led = track.led;
    robot.led_known = track.sighting.has_value();
    robot.disc = track.sighting ? found[*track.sighting].disc
                                : Circle{floor_->pixel(robot.position), detector_.look()->radius_px};
    robots.push_back(robot);
  }
  return robots;
}

}  // namespace kilotwin::track
