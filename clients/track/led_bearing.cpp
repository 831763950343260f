#include "clients/track/led_bearing.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

constexpr double kEnough = 60;         ///< readings
constexpr std::size_t kWindow = 6;     ///< bins, 60 degrees, around the mode
constexpr double kAgreement = 0.6;     ///< share of the readings in the window
constexpr double kLeastSd_rad = 0.05;  ///< of one reading: robots are not built alike
/// Old readings lose weight beyond this count: a camera may be turned.
constexpr double kMostWeight = 20000;

constexpr double kStraight_mm = 0.7;  ///< deviation from the chord
constexpr double kDriven_mm = 10;     ///< in the whole time

}  // namespace

void LedBearing::add(double bearing_rad, double heading_rad) {
  double total = 0;
  for (const Bin& bin : bins_) total += bin.count;
  if (total >= kMostWeight) {
    for (Bin& bin : bins_) bin = {bin.count / 2, bin.cos / 2, bin.sin / 2};
  }
  const double off = wrapped(bearing_rad - heading_rad);
  const auto index = static_cast<std::size_t>((off + kPi) / (2 * kPi) * kBins);
  Bin& bin = bins_.at(std::min(index, kBins - 1));
  bin.count += 1;
  bin.cos += std::cos(off);
  bin.sin += std::sin(off);
}

std::optional<LedMount> LedBearing::mount() const {
  double total = 0;
  Bin best;
  for (std::size_t first = 0; first < kBins; ++first) {
    total += bins_.at(first).count;
    Bin window;
    for (std::size_t i = 0; i < kWindow; ++i) {
      const Bin& bin = bins_.at((first + i) % kBins);
      window = {window.count + bin.count, window.cos + bin.cos, window.sin + bin.sin};
    }
    if (window.count > best.count) best = window;
  }
  if (total < kEnough || best.count < kAgreement * total) return std::nullopt;
  const double agreement = std::hypot(best.cos, best.sin) / best.count;
  // Circular standard deviation.
  const double sd = std::sqrt(-2 * std::log(std::min(agreement, 1 - 1e-9)));
  return LedMount{std::atan2(best.sin, best.cos), std::max(kLeastSd_rad, sd)};
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
