#include "clients/track/detect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clients/track/radial_votes.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::track {
namespace {

/// A circle with at least this coverage may be a robot.
constexpr double kLeastCoverage = 0.64, kLeastSeen = 0.27;
/// A circle with less coverage is none.
constexpr double kDoubtful = 0.42;
/// Share of the median contrast that each robot has at least.
constexpr double kLeastContrast = 0.5;
/// How far the radii of one picture differ from their median: perspective, lens.
constexpr double kRadiusSpread = 0.13;
constexpr double kRungs = 1.13;  ///< ratio of the radii that are tried in turn
/// Error of a centre, px, that the edge points do not show.
constexpr double kLeastError_px = 0.016;
/// Rays per independent one, times the radius. Measured: docs/results/camera-tracker.md, "Stated uncertainty".
constexpr double kTogether_px = 52;
/// Centres of two robots are two radii apart. The seen radius is a bit smaller or larger than the body's.
constexpr double kLeastDistance = 1.8;

double distance(const Point& a, const Point& b) { return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px); }

/// How strongly a circle speaks for a robot.
double strength(const FittedCircle& circle) {
  return circle.coverage * std::min(1.0, circle.contrast / 0.2) -
         2.0 * circle.residual_px / circle.circle.radius_px;
}

/// The strongest circles of which no two overlap.
std::vector<FittedCircle> apart(std::vector<FittedCircle> circles) {
  std::stable_sort(circles.begin(), circles.end(),
                   [](const FittedCircle& a, const FittedCircle& b) { return strength(a) > strength(b); });
  std::vector<FittedCircle> kept;
  for (const FittedCircle& circle : circles) {
    const bool free = std::none_of(kept.begin(), kept.end(), [&](const FittedCircle& other) {
      return distance(circle.circle.centre, other.circle.centre) <
             kLeastDistance * 0.5 * (circle.circle.radius_px + other.circle.radius_px);
    });
    if (free) kept.push_back(circle);
  }
  return kept;
}

std::vector<FittedCircle> fit_all(const cv::Mat& grey, const std::vector<Candidate>& candidates, double tolerance) {
  std::vector<FittedCircle> fitted;
  FitLimits limits;
  limits.radius_tolerance = tolerance;
  for (const Candidate& candidate : candidates) {
    if (const std::optional<FittedCircle> circle = fit_circle(grey, candidate.circle, limits))
      fitted.push_back(*circle);
  }
  return fitted;
}

std::vector<FittedCircle> only_covered(std::vector<FittedCircle> circles) {
  std::erase_if(circles, [](const FittedCircle& c) { return c.coverage < kLeastCoverage || c.seen < kLeastSeen; });
  return circles;
}

/// The radius that most circles have. Nothing where there is no circle.
std::optional<double> common_radius(const cv::Mat& grey) {
  constexpr std::size_t kMostCandidates = 400;
  double best = 0;
  std::optional<double> radius;
  const double most = std::min(kMostRadius_px, 0.25 * std::min(grey.cols, grey.rows));
  for (int k = 0; kLeastRadius_px * std::pow(kRungs, k) <= most; ++k) {
    const double rung = kLeastRadius_px * std::pow(kRungs, k);
    const std::vector<FittedCircle> circles =
        apart(only_covered(fit_all(grey, vote(grey, rung, kMostCandidates), kRungs - 1)));
    double evidence = 0;
    std::vector<double> radii;
    for (const FittedCircle& circle : circles) {
      const double beyond = circle.coverage - 0.55;
      evidence += beyond * beyond * std::min(1.0, circle.contrast / 0.3);
      if (circle.coverage > 0.7) radii.push_back(circle.circle.radius_px);
    }
    if (evidence > best && !radii.empty()) {
      best = evidence;
      radius = stats::upper_median(radii);
    }
  }
  return radius;
}

/// Fits again with the knowledge of which rays neighbours hide.
std::vector<FittedCircle> with_neighbours(const cv::Mat& grey, const std::vector<FittedCircle>& circles,
                                          double radius_px) {
  std::vector<FittedCircle> again;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    FitLimits limits;
    limits.radius_tolerance = kRadiusSpread;
    for (std::size_t j = 0; j < circles.size(); ++j) {
      // A doubtful circle hides nothing.
      if (j != i && circles[j].coverage > kDoubtful &&
          distance(circles[i].circle.centre, circles[j].circle.centre) < 3 * radius_px)
        limits.neighbours.push_back(circles[j].circle);
    }
    if (limits.neighbours.empty()) {
      again.push_back(circles[i]);
    } else if (const auto circle = fit_circle(grey, {circles[i].circle.centre, radius_px}, limits)) {
      again.push_back(*circle);
    }
  }
  return again;
}

/// Points that have the distance of two touching robots from two robots each: where a robot in a crowd may be.
std::vector<Point> places_between(const std::vector<FittedCircle>& circles, double radius_px) {
  constexpr double kTouching = 2.08;  ///< radii; the seen radius is a bit smaller than the body's
  const double side = kTouching * radius_px;
  std::vector<Point> places;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    for (std::size_t j = i + 1; j < circles.size(); ++j) {
      const Point &a = circles[i].circle.centre, &b = circles[j].circle.centre;
      const double apart_px = distance(a, b);
      if (apart_px > 1.95 * side || apart_px < 1e-6) continue;
      const double height = std::sqrt(side * side - apart_px * apart_px / 4) / apart_px;
      const double dx = b.x_px - a.x_px, dy = b.y_px - a.y_px;
      for (const double to : {-height, height}) {
        const Point place{0.5 * (a.x_px + b.x_px) - to * dy, 0.5 * (a.y_px + b.y_px) + to * dx};
        const auto near = [&](const Point& other) { return distance(place, other) < 0.3 * radius_px; };
        const bool free = std::none_of(circles.begin(), circles.end(), [&](const FittedCircle& other) {
          return distance(place, other.circle.centre) < kLeastDistance * radius_px;
        });
        if (free && std::none_of(places.begin(), places.end(), near)) places.push_back(place);
      }
    }
  }
  return places;
}

/// Adds robots that others hide in part, until there are no more: those found so far tell which rays are hidden.
void add_hidden(const cv::Mat& grey, const std::vector<Candidate>& candidates, double radius_px,
                std::vector<FittedCircle>& circles) {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Point> places = places_between(circles, radius_px);
    for (const Candidate& candidate : candidates) places.push_back(candidate.circle.centre);
    std::vector<FittedCircle> more;
    for (const Point& place : places) {
      FitLimits limits;
      limits.radius_tolerance = kRadiusSpread;
      bool free = true;
      for (const FittedCircle& other : circles) {
        const double off = distance(place, other.circle.centre);
        free = free && off > 1.2 * radius_px;
        if (off < 3 * radius_px) limits.neighbours.push_back(other.circle);
      }
      if (!free || limits.neighbours.empty()) continue;
      if (const auto circle = fit_circle(grey, {place, radius_px}, limits)) more.push_back(*circle);
    }
    std::erase_if(more, [&](const FittedCircle& c) {
      return c.coverage < kLeastCoverage || c.seen < kLeastSeen ||
             std::any_of(circles.begin(), circles.end(), [&](const FittedCircle& other) {
               return distance(c.circle.centre, other.circle.centre) < kLeastDistance * radius_px;
             });
    });
    more = apart(more);
    if (more.empty()) return;
    circles.insert(circles.end(), more.begin(), more.end());
  }
}

Detection detection_of(const FittedCircle& circle) {
  // Errors of neighbouring rays go together: a rim has as many independent points as pixels, about.
  const double together = std::max(1.0, kTogether_px / circle.circle.radius_px);
  const double ray_px2 = circle.residual_px * circle.residual_px;
  const cv::Matx22d& spread = circle.spread;
  const Covariance by_rays = Covariance{spread(0, 0), spread(0, 1), spread(1, 1)}.times(together * ray_px2);
  return {circle.circle, circle.coverage, circle.contrast, by_rays.plus(Covariance::round(kLeastError_px))};
}

}  // namespace

std::string scale_advice(std::optional<double> radius_px) {
  if (!radius_px) {
    return fmt::format(
        "no robots are found; their discs must be darker than the floor, with a radius of {:g} to {:g} pixels, "
        "better "
        "{:g} or more",
        kLeastRadius_px, kMostRadius_px, kWellSeenRadius_px);
  }
  if (*radius_px >= kWellSeenRadius_px) return {};
  const double more = kWellSeenRadius_px / *radius_px;
  return fmt::format(
      "the robots' discs have a radius of {:.1f} pixels; below {:g}, robots that touch or lie in clutter are "
      "missed{}. "
      "Use {:.1f} times the resolution, or mount the camera at {:.2f} of its height, or let the camera see a "
      "smaller part of the "
      "arena",
      *radius_px, kWellSeenRadius_px, *radius_px < kLeastRadius_px ? ", and many others too" : "", more, 1 / more);
}

Detector::Detector(std::optional<double> radius_px) : known_radius_px_(radius_px) {}

std::vector<Detection> Detector::find(const cv::Mat& grey) {
  std::optional<double> radius = known_radius_px_;
  if (!radius && look_) radius = look_->radius_px;
  if (!radius) radius = common_radius(grey);
  if (!radius) return {};

  const std::vector<Candidate> candidates = vote(grey, *radius);
  std::vector<FittedCircle> circles = apart(fit_all(grey, candidates, kRadiusSpread));
  std::erase_if(circles, [](const FittedCircle& c) { return c.coverage < kDoubtful; });
  circles = apart(only_covered(with_neighbours(grey, circles, *radius)));
  if (circles.empty()) return {};

  // The median contrast and radius tell the robots from other circles.
  std::vector<double> contrasts, radii;
  for (const FittedCircle& circle : circles) {
    if (circle.coverage < 0.7) continue;
    contrasts.push_back(circle.contrast);
    radii.push_back(circle.circle.radius_px);
  }
  if (contrasts.empty()) return {};
  const Look look{stats::upper_median(radii), stats::upper_median(contrasts)};
  const auto unlike = [&](const FittedCircle& c) {
    return c.contrast < kLeastContrast * look.contrast ||
           std::abs(c.circle.radius_px - look.radius_px) > kRadiusSpread * look.radius_px;
  };
  std::erase_if(circles, unlike);
  add_hidden(grey, candidates, look.radius_px, circles);
  std::erase_if(circles, unlike);
  look_ = look;
  std::vector<Detection> found;
  found.reserve(circles.size());
  for (const FittedCircle& circle : circles) found.push_back(detection_of(circle));
  std::sort(found.begin(), found.end(),
            [](const Detection& a, const Detection& b) { return a.disc.centre.x_px < b.disc.centre.x_px; });
  return found;
}

bool Detector::accepts(const FittedCircle& circle) const {
  return circle.coverage >= kLeastCoverage && circle.seen >= kLeastSeen &&
         circle.contrast >= kLeastContrast * look_->contrast &&
         std::abs(circle.circle.radius_px - look_->radius_px) <= kRadiusSpread * look_->radius_px;
}

std::vector<Detection> Detector::find_more(const cv::Mat& grey, const cv::Rect& region,
                                           const std::vector<Circle>& known) const {
  const cv::Rect inside = region & cv::Rect(0, 0, grey.cols, grey.rows);
  if (!look_ || inside.width < 8 || inside.height < 8) return {};
  std::vector<FittedCircle> circles;
  constexpr std::size_t kMost = 200;
  for (Candidate candidate : vote(grey(inside), look_->radius_px, kMost)) {
    candidate.circle.centre.x_px += inside.x;
    candidate.circle.centre.y_px += inside.y;
    FitLimits limits;
    limits.radius_tolerance = kRadiusSpread;
    bool free = true;
    for (const Circle& other : known) {
      const double off = distance(candidate.circle.centre, other.centre);
      free = free && off > 1.2 * look_->radius_px;
      if (off < 3 * look_->radius_px) limits.neighbours.push_back(other);
    }
    if (!free) continue;
    const std::optional<FittedCircle> circle = fit_circle(grey, candidate.circle, limits);
    if (!circle || !accepts(*circle)) continue;
    const bool new_one = std::none_of(known.begin(), known.end(), [&](const Circle& other) {
      return distance(circle->circle.centre, other.centre) < kLeastDistance * look_->radius_px;
    });
    if (new_one) circles.push_back(*circle);
  }
  std::vector<Detection> found;
  for (const FittedCircle& circle : apart(circles)) found.push_back(detection_of(circle));
  return found;
}

std::optional<Detection> Detector::find_near(const cv::Mat& grey, const Point& predicted, double reach_px,
                                             const std::vector<Circle>& neighbours) const {
  if (!look_) return std::nullopt;
  FitLimits limits;
  limits.radius_tolerance = kRadiusSpread;
  limits.neighbours = neighbours;
  const auto accepted = [&](const std::optional<FittedCircle>& circle) {
    return circle && accepts(*circle) && distance(circle->circle.centre, predicted) <= reach_px;
  };
  const std::optional<FittedCircle> direct = fit_circle(grey, {predicted, look_->radius_px}, limits);
  if (accepted(direct)) return detection_of(*direct);
  if (reach_px < 0.3 * look_->radius_px) return std::nullopt;

  // Farther away: votes within the region.
  const double reach = reach_px + 1.6 * look_->radius_px;
  const cv::Rect region = cv::Rect(cvFloor(predicted.x_px - reach), cvFloor(predicted.y_px - reach),
                                   cvCeil(2 * reach) + 1, cvCeil(2 * reach) + 1) &
                          cv::Rect(0, 0, grey.cols, grey.rows);
  if (region.width < 8 || region.height < 8) return std::nullopt;
  std::optional<FittedCircle> best;
  constexpr std::size_t kMost = 12;
  for (Candidate candidate : vote(grey(region), look_->radius_px, kMost)) {
    candidate.circle.centre.x_px += region.x;
    candidate.circle.centre.y_px += region.y;
    const std::optional<FittedCircle> circle = fit_circle(grey, candidate.circle, limits);
    if (accepted(circle) && (!best || strength(*circle) > strength(*best))) best = circle;
  }
  if (!best) return std::nullopt;
  return detection_of(*best);
}

}  // namespace kilotwin::track
