#include "clients/track/led_bearing.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::track {
namespace {

constexpr long kEnough = 60;           ///< readings
constexpr double kAgreement = 0.94;    ///< mean resultant length: a circular standard deviation of 20 degrees
constexpr double kLeastSd_rad = 0.05;  ///< of one reading: robots are not built alike
/// Old readings lose weight beyond this count: a camera may be turned.
constexpr double kMostWeight = 20000;

constexpr double kStraight_mm = 0.7;  ///< deviation from the chord
constexpr double kDriven_mm = 10;     ///< in the whole time

}  // namespace

void LedBearing::add(double bearing_rad, double heading_rad) {
  if (static_cast<double>(count_) >= kMostWeight) {
    cos_ /= 2;
    sin_ /= 2;
    count_ /= 2;
  }
  cos_ += std::cos(bearing_rad - heading_rad);
  sin_ += std::sin(bearing_rad - heading_rad);
  ++count_;
}

std::optional<LedMount> LedBearing::mount() const {
  if (count_ < kEnough) return std::nullopt;
  const double agreement = std::hypot(cos_, sin_) / static_cast<double>(count_);
  if (agreement < kAgreement) return std::nullopt;
  // Circular standard deviation.
  const double sd = std::sqrt(-2 * std::log(std::min(agreement, 1 - 1e-9)));
  return LedMount{std::atan2(sin_, cos_), std::max(kLeastSd_rad, sd)};
}

void StraightPath::add(double time_s, double x_mm, double y_mm) {
  if (count_ > 0 && time_s - places_[count_ - 1].time_s < kEvery_s) return;
  if (count_ > 0 && time_s - places_[count_ - 1].time_s > 2 * kEvery_s) count_ = 0;
  if (count_ == kPoints) {
    std::copy(places_ + 1, places_ + kPoints, places_);
    --count_;
  }
  places_[count_++] = {time_s, x_mm, y_mm};
}

std::optional<double> StraightPath::heading_rad() const {
  if (count_ < kPoints) return std::nullopt;
  const Place &first = places_[0], &last = places_[kPoints - 1];
  const double dx = last.x_mm - first.x_mm, dy = last.y_mm - first.y_mm, length = std::hypot(dx, dy);
  if (length < kDriven_mm) return std::nullopt;
  for (const Place& place : places_) {
    const double off = (dx * (place.y_mm - first.y_mm) - dy * (place.x_mm - first.x_mm)) / length;
    if (std::abs(off) > kStraight_mm) return std::nullopt;
  }
  return std::atan2(dy, dx);
}

}  // namespace kilotwin::track
